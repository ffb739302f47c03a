//! Permissions of requests by their tokens: to read, or to control as well.

use axum::http::{HeaderMap, Method, StatusCode, Uri, header};

use super::{LiveError, LiveOptions};
use crate::record::{Hosts, Refused, query};

/// Characters of the shortest token.
const SHORTEST_TOKEN: usize = 16;

/// The hosts and tokens of a server.
#[derive(Debug, Clone)]
pub(super) struct Access {
    pub(super) hosts: Hosts,
    control: Option<String>,
    read_only: Option<String>,
}

/// The permissions of a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Right {
    /// Read and control.
    Control,
    /// Read.
    Read,
}

impl Access {
    pub(super) fn new(options: &LiveOptions) -> Result<Self, LiveError> {
        let LiveOptions { host, control, read_only, .. } = options.clone();
        if control.is_none() && !options.address.ip().is_loopback() {
            return Err(LiveError::Open(options.address.ip()));
        }
        let short = control.iter().chain(&read_only).map(|token| token.chars().count());
        if let Some(found) = short.filter(|count| *count < SHORTEST_TOKEN).min() {
            return Err(LiveError::ShortToken(found));
        }
        let hosts = Hosts { name: host, any_address: control.is_some() };
        Ok(Self { hosts, control, read_only })
    }

    /// The permissions of the request's token, from `Authorization: Bearer` or from the address (`?token=`).
    pub(super) fn right(&self, headers: &HeaderMap, uri: &Uri) -> Result<Right, Refused> {
        let Some(control) = &self.control else { return Ok(Right::Control) };
        let bearer = headers.get(header::AUTHORIZATION).and_then(|value| value.to_str().ok());
        let bearer = bearer.and_then(|value| value.strip_prefix("Bearer "));
        let given = bearer.map(str::to_owned).or_else(|| query(uri, "token"));
        match given.as_deref() {
            Some(token) if same(token, control) => Ok(Right::Control),
            Some(token) if self.read_only.as_ref().is_some_and(|read_only| same(token, read_only)) => Ok(Right::Read),
            found => {
                let found = if found.is_some() { "found another token" } else { "found no token" };
                let refused = format!("{found}, expected `Authorization: Bearer TOKEN` with the printed one");
                Err((StatusCode::UNAUTHORIZED, refused))
            }
        }
    }
}

/// Refuses requests from another site's page, which browsers mark even where they send no `Origin`, for a picture for one.
pub(super) fn check_site(headers: &HeaderMap) -> Result<(), Refused> {
    match headers.get("sec-fetch-site").map(|value| value.to_str().unwrap_or("(not text)")) {
        None | Some("same-origin" | "none") => Ok(()),
        Some(site) => {
            let refused = format!("found Sec-Fetch-Site: {site}, expected this server's own page or none");
            Err((StatusCode::FORBIDDEN, refused))
        }
    }
}

/// Refuses a change by a client that may only read.
pub(super) fn may(right: Right, method: &Method) -> Result<(), Refused> {
    if right == Right::Control || [Method::GET, Method::HEAD].contains(method) {
        return Ok(());
    }
    Err((StatusCode::FORBIDDEN, format!("found {method} with the read-only token, expected the control token")))
}

/// Compares two tokens in a time that does not depend on where they differ.
fn same(a: &str, b: &str) -> bool {
    blake3::hash(a.as_bytes()) == blake3::hash(b.as_bytes())
}

/// 128 random bits from the system, as hexadecimal digits.
///
/// # Errors
/// The system has no random numbers.
pub fn random_token() -> std::io::Result<String> {
    let mut bytes = [0_u8; 16];
    getrandom::fill(&mut bytes).map_err(|e| std::io::Error::other(e.to_string()))?;
    Ok(format!("{:032x}", u128::from_le_bytes(bytes)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::Limits;

    fn access(address: &str, control: Option<&str>) -> Result<Access, LiveError> {
        Access::new(&LiveOptions {
            address: address.parse().unwrap(),
            host: Some("drape.example".to_owned()),
            control: control.map(str::to_owned),
            read_only: control.map(|_| "o".repeat(20)),
            files: Vec::new(),
            limits: Limits::default(),
            name: String::new(),
            front: glam::DVec3::NEG_Y,
        })
    }

    #[test]
    fn tokens_tell_control_from_reading() {
        assert!(matches!(access("0.0.0.0:0", None), Err(LiveError::Open(_))));
        assert!(matches!(access("0.0.0.0:0", Some("short")), Err(LiveError::ShortToken(5))));
        let far = access("0.0.0.0:0", Some(&"c".repeat(20))).unwrap();
        let right = |uri: &str| far.right(&HeaderMap::new(), &uri.parse().unwrap()).map_err(|refused| refused.0);
        assert_eq!(right(&format!("/?token={}", "c".repeat(20))), Ok(Right::Control));
        assert_eq!(right(&format!("/?token={}", "o".repeat(20))), Ok(Right::Read));
        assert_eq!(right("/?token=guess"), Err(StatusCode::UNAUTHORIZED));
        assert_eq!(right("/"), Err(StatusCode::UNAUTHORIZED));
        assert!(may(Right::Read, &Method::GET).is_ok() && may(Right::Read, &Method::PATCH).is_err());
        let (a, b) = (random_token().unwrap(), random_token().unwrap());
        assert!(a.len() == 32 && a != b);
    }
}
