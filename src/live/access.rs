//! Who may do what: tokens, and against pages of others the headers `Host` and `Origin`.
//!
//! A page of another site can send requests here, but its browser says so in `Origin`; and a name that was made to point here
//! (DNS rebinding) stands in `Host`. Both are refused, so that such a page can neither read nor steer.

use std::net::IpAddr;

use hyper::header::{self, HeaderMap};
use hyper::{Method, StatusCode, Uri};

use super::{LiveError, LiveOptions};

/// Characters of the shortest token.
const SHORTEST_TOKEN: usize = 16;

/// Whom the server trusts.
#[derive(Debug, Clone)]
pub(super) struct Access {
    host: Option<String>,
    control: Option<String>,
    onlooker: Option<String>,
}

/// What a request may do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Right {
    /// Read and steer.
    Control,
    /// Read.
    Look,
}

/// A refusal: status and sentence.
pub(super) type Refused = (StatusCode, String);

impl Access {
    pub(super) fn new(options: &LiveOptions) -> Result<Self, LiveError> {
        let LiveOptions { host, control, onlooker, .. } = options.clone();
        if control.is_none() && !options.address.ip().is_loopback() {
            return Err(LiveError::Open(options.address.ip()));
        }
        let short = control.iter().chain(&onlooker).map(|token| token.chars().count());
        if let Some(found) = short.filter(|count| *count < SHORTEST_TOKEN).min() {
            return Err(LiveError::ShortToken(found));
        }
        Ok(Self { host, control, onlooker })
    }

    /// Whether the request names this server, and comes from its own page or from no page.
    pub(super) fn check_origin(&self, headers: &HeaderMap) -> Result<(), Refused> {
        let text = |name| headers.get(name).map(|value| value.to_str().unwrap_or("(not text)"));
        let Some(host) = text(header::HOST) else {
            return Err((StatusCode::BAD_REQUEST, "no Host header, expected one".to_owned()));
        };
        if !self.knows(host) {
            let said = format!("found Host: {host}, expected an address of this server; allow a name with --host");
            return Err((StatusCode::MISDIRECTED_REQUEST, said));
        }
        match text(header::ORIGIN) {
            None => Ok(()),
            Some(origin) if ["http://", "https://"].iter().any(|s| origin.strip_prefix(s) == Some(host)) => Ok(()),
            Some(origin) => {
                let said = format!("found Origin: {origin}, expected this server's own page or none");
                Err((StatusCode::FORBIDDEN, said))
            }
        }
    }

    fn knows(&self, host: &str) -> bool {
        let name = host.rsplit_once(':').filter(|(_, port)| port.parse::<u16>().is_ok()).map_or(host, |(name, _)| name);
        let address = name.trim_start_matches('[').trim_end_matches(']').parse::<IpAddr>();
        // An address was not made to point here by a name; from elsewhere than here only with a token.
        let near = |ip: IpAddr| self.control.is_some() || ip.is_loopback();
        address.is_ok_and(near) || name == "localhost" || self.host.as_deref() == Some(name)
    }

    /// What the token of a request allows: that of `Authorization: Bearer`, or of the address (`?token=`).
    pub(super) fn right(&self, headers: &HeaderMap, uri: &Uri) -> Result<Right, Refused> {
        let Some(control) = &self.control else { return Ok(Right::Control) };
        let bearer = headers.get(header::AUTHORIZATION).and_then(|value| value.to_str().ok());
        let bearer = bearer.and_then(|value| value.strip_prefix("Bearer "));
        let given = bearer.or_else(|| query(uri, "token"));
        match given {
            Some(token) if same(token, control) => Ok(Right::Control),
            Some(token) if self.onlooker.as_ref().is_some_and(|onlooker| same(token, onlooker)) => Ok(Right::Look),
            found => {
                let found = if found.is_some() { "found another token" } else { "found no token" };
                let said = format!("{found}, expected `Authorization: Bearer TOKEN` with the one that was printed");
                Err((StatusCode::UNAUTHORIZED, said))
            }
        }
    }
}

/// Whether it is another site's page that asks, as browsers say of requests without an `Origin` too, a picture's say.
pub(super) fn check_site(headers: &HeaderMap) -> Result<(), Refused> {
    match headers.get("sec-fetch-site").map(|value| value.to_str().unwrap_or("(not text)")) {
        None | Some("same-origin" | "none") => Ok(()),
        Some(site) => {
            let said = format!("found Sec-Fetch-Site: {site}, expected this server's own page or none");
            Err((StatusCode::FORBIDDEN, said))
        }
    }
}

/// Whether a request of this method and right may go on.
pub(super) fn may(right: Right, method: &Method) -> Result<(), Refused> {
    if right == Right::Control || [Method::GET, Method::HEAD].contains(method) {
        return Ok(());
    }
    Err((StatusCode::FORBIDDEN, format!("found {method} with an onlooker's token, expected the one for control")))
}

/// A parameter of the address, as it stands there.
pub(super) fn query<'a>(uri: &'a Uri, name: &str) -> Option<&'a str> {
    let pairs = uri.query()?.split('&').filter_map(|pair| pair.split_once('='));
    pairs.filter(|(key, _)| *key == name).map(|(_, value)| value).next()
}

/// In a time that tells nothing of where two tokens differ.
fn same(a: &str, b: &str) -> bool {
    blake3::hash(a.as_bytes()) == blake3::hash(b.as_bytes())
}

/// 128 random bits in hexadecimal digits, from the system.
///
/// # Errors
/// Where the system has none.
pub fn random_token() -> std::io::Result<String> {
    let mut bytes = [0_u8; 16];
    getrandom::fill(&mut bytes).map_err(|e| std::io::Error::other(e.to_string()))?;
    Ok(format!("{:032x}", u128::from_le_bytes(bytes)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn access(address: &str, control: Option<&str>) -> Result<Access, LiveError> {
        Access::new(&LiveOptions {
            address: address.parse().unwrap(),
            host: Some("drape.example".to_owned()),
            control: control.map(str::to_owned),
            onlooker: control.map(|_| "o".repeat(20)),
            files: Vec::new(),
            name: String::new(),
            front: glam::DVec3::NEG_Y,
        })
    }

    fn headers(host: &str, origin: Option<&str>) -> HeaderMap {
        let mut headers = HeaderMap::new();
        headers.insert(header::HOST, host.parse().unwrap());
        if let Some(origin) = origin {
            headers.insert(header::ORIGIN, origin.parse().unwrap());
        }
        headers
    }

    #[test]
    fn other_hosts_and_origins_are_refused() {
        let near = access("127.0.0.1:0", None).unwrap();
        let far = access("0.0.0.0:0", Some(&"c".repeat(20))).unwrap();
        let ok =
            |access: &Access, host: &str, origin: Option<&str>| access.check_origin(&headers(host, origin)).is_ok();
        assert!(ok(&near, "127.0.0.1:8080", None) && ok(&near, "localhost:8080", Some("http://localhost:8080")));
        assert!(ok(&near, "[::1]:8080", Some("http://[::1]:8080")) && ok(&near, "drape.example", None));
        assert!(!ok(&near, "evil.example:8080", None), "a name that was made to point here");
        assert!(!ok(&near, "192.168.0.7:8080", None) && ok(&far, "192.168.0.7:8080", None));
        for origin in ["http://evil.example", "null", "http://127.0.0.1:9", "https://127.0.0.1:8080.evil.example"] {
            assert!(!ok(&near, "127.0.0.1:8080", Some(origin)), "{origin}");
        }
    }

    #[test]
    fn tokens_say_who_steers_and_who_looks_on() {
        assert!(matches!(access("0.0.0.0:0", None), Err(LiveError::Open(_))));
        assert!(matches!(access("0.0.0.0:0", Some("short")), Err(LiveError::ShortToken(5))));
        let far = access("0.0.0.0:0", Some(&"c".repeat(20))).unwrap();
        let right = |uri: &str| far.right(&HeaderMap::new(), &uri.parse().unwrap()).map_err(|refused| refused.0);
        assert_eq!(right(&format!("/?token={}", "c".repeat(20))), Ok(Right::Control));
        assert_eq!(right(&format!("/?token={}", "o".repeat(20))), Ok(Right::Look));
        assert_eq!(right("/?token=guess"), Err(StatusCode::UNAUTHORIZED));
        assert_eq!(right("/"), Err(StatusCode::UNAUTHORIZED));
        assert!(may(Right::Look, &Method::GET).is_ok() && may(Right::Look, &Method::PATCH).is_err());
        let (a, b) = (random_token().unwrap(), random_token().unwrap());
        assert!(a.len() == 32 && a != b);
    }
}
