//! Which names a server answers to. A page of another site can send requests here, but its browser names that site in `Origin`;
//! a name that was made to resolve to this machine (DNS rebinding) stands in `Host`. Both are refused.

use std::net::IpAddr;

use axum::http::{HeaderMap, HeaderName, StatusCode, Uri, header, uri::Authority};

/// A refusal: status and sentence.
pub(crate) type Refused = (StatusCode, String);

/// The hosts of a server: loopback addresses and `localhost` always.
#[derive(Debug, Clone, Default)]
pub(crate) struct Hosts {
    /// A further name.
    pub(crate) name: Option<String>,
    /// Whether any address will do. Names resolve to addresses, so an address in `Host` is not rebound; but without a token
    /// only this machine's own may control.
    pub(crate) any_address: bool,
}

impl Hosts {
    /// Refuses a request for another host, or from the page of another origin.
    pub(crate) fn check(&self, headers: &HeaderMap, uri: &Uri) -> Result<(), Refused> {
        let text = |name: HeaderName| {
            headers.get_all(name).iter().map(|value| value.to_str().unwrap_or("(not text)")).collect::<Vec<_>>()
        };
        let hosts = text(header::HOST);
        // HTTP/2 has the host in the request's address, and HTTP/1 may have it there as well.
        let authority = uri.authority().map(Authority::as_str);
        let Some(&host) = hosts.iter().chain(&authority).next().filter(|_| hosts.len() < 2) else {
            return Err((StatusCode::BAD_REQUEST, format!("found {} Host headers, expected one", hosts.len())));
        };
        if let Some(other) = hosts.iter().chain(&authority).find(|host| !self.knows(host)) {
            let refused = format!("found Host: {other}, expected an address of this server; allow a name with --host");
            return Err((StatusCode::MISDIRECTED_REQUEST, refused));
        }
        let own = |origin: &str| ["http://", "https://"].iter().any(|s| origin.strip_prefix(s) == Some(host));
        match text(header::ORIGIN).into_iter().find(|origin| !own(origin)) {
            None => Ok(()),
            Some(origin) => {
                let refused = format!("found Origin: {origin}, expected this server's own page or none");
                Err((StatusCode::FORBIDDEN, refused))
            }
        }
    }

    fn knows(&self, host: &str) -> bool {
        let name = host.rsplit_once(':').filter(|(_, port)| port.parse::<u16>().is_ok()).map_or(host, |(name, _)| name);
        let address = name.trim_start_matches('[').trim_end_matches(']').parse::<IpAddr>();
        address.is_ok_and(|ip| self.any_address || ip.is_loopback())
            || name == "localhost"
            || self.name.as_deref() == Some(name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_hosts_and_origins_are_refused() {
        let near = Hosts { name: Some("drape.example".to_owned()), any_address: false };
        let far = Hosts { any_address: true, ..near.clone() };
        let status = |hosts: &Hosts, named: &[&str], origins: &[&str], uri: &str| {
            let mut headers = HeaderMap::new();
            let named = named.iter().map(|host| (header::HOST, host.parse().unwrap()));
            headers.extend(named.chain(origins.iter().map(|origin| (header::ORIGIN, origin.parse().unwrap()))));
            hosts.check(&headers, &uri.parse().unwrap()).map_err(|refused| refused.0.as_u16())
        };
        for (host, origin) in [
            ("127.0.0.1:8080", None),
            ("localhost:8080", Some("http://localhost:8080")),
            ("[::1]:8080", Some("http://[::1]:8080")),
            ("drape.example", None),
        ] {
            assert_eq!(status(&near, &[host], origin.as_slice(), "/"), Ok(()), "{host}");
            assert_eq!(status(&near, &[], origin.as_slice(), &format!("http://{host}/")), Ok(()), "HTTP/2: {host}");
        }
        assert_eq!(status(&near, &["evil.example:8080"], &[], "/"), Err(421), "a rebound name");
        assert_eq!(status(&near, &["127.0.0.1"], &[], "http://evil.example/"), Err(421));
        assert_eq!(status(&near, &["192.168.0.7:8080"], &[], "/"), Err(421));
        assert_eq!(status(&far, &["192.168.0.7:8080"], &[], "/"), Ok(()));
        assert_eq!(status(&near, &[], &[], "/"), Err(400));
        assert_eq!(status(&near, &["127.0.0.1", "127.0.0.1"], &[], "/"), Err(400));
        for origin in ["http://evil.example", "null", "http://127.0.0.1:9", "https://127.0.0.1:8080.evil.example"] {
            assert_eq!(status(&near, &["127.0.0.1:8080"], &[origin], "/"), Err(403), "{origin}");
        }
        let both = ["http://127.0.0.1:8080", "http://evil.example"];
        assert_eq!(status(&near, &["127.0.0.1:8080"], &both, "/"), Err(403));
    }
}
