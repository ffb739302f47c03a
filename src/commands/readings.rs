//! `--reading`: the readings of the paper's equations by name, so that the literal ones can be run and seen to fail.

use crate::mechanics::paper::PaperOptions;
use serde_json::{Value, json};

/// What `--help` says of them.
pub(crate) const HELP: &str = "\
Readings of equations (2) to (9) for `paper`, the default first:
volume=area|cuboid, cosine=absolute|signed|in-surface, clearance=plus-thickness|literal, contactless=as-equation-6|as-printed, \
body-force=balance|N/m³, line-force=membrane|N/m⁵, contact-distance=0.5 (cm)";

/// One `KEY=VALUE`: a key of the options and what it becomes.
pub(crate) type Reading = (String, Value);

/// Reads one `KEY=VALUE`.
pub(crate) fn parse(text: &str) -> Result<Reading, String> {
    let (key, word) = text.split_once('=').ok_or("expected KEY=VALUE, e.g. cosine=signed")?;
    let number = word.parse::<f64>().ok().filter(|x| x.is_finite() && *x >= 0.0);
    let reading = match (key, number) {
        ("contact-distance", Some(cm)) => ("contact_distance_m".to_owned(), json!(cm / 100.0)),
        (_, Some(given)) => (key.replace('-', "_"), json!({ "given": given })),
        (_, None) => (key.replace('-', "_"), json!(word)),
    };
    options(std::slice::from_ref(&reading)).map_err(|_| HELP.to_owned())?;
    Ok(reading)
}

/// The default readings with the given ones over them.
pub(crate) fn options(readings: &[Reading]) -> serde_json::Result<PaperOptions> {
    // What is left out is the default.
    serde_json::from_value(Value::Object(readings.iter().cloned().collect()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mechanics::paper::{BodyForce, Cosine, Volume};

    #[test]
    fn readings_are_read_and_others_refused() {
        let some = ["cosine=signed", "contact-distance=1.5", "body-force=12", "contactless=as-equation-6"];
        let options = options(&some.map(|t| parse(t).unwrap())).unwrap();
        assert_eq!(options.cosine, Cosine::Signed);
        assert_eq!(options.contact_distance_m, 0.015);
        assert_eq!(options.body_force, BodyForce::Given(12.0));
        assert_eq!(options.volume, Volume::default());
        for right in ["volume=area", "clearance=plus-thickness", "body-force=balance", "line-force=membrane"] {
            assert!(parse(right).is_ok(), "{right}");
        }
        for wrong in ["cosine", "cosine=sine", "tangent=1", "body-force=much", "contact-distance=-1", "cosine=3"] {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
    }
}
