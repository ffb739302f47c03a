//! `--reading`: the readings of the paper's equations by name, so that the literal ones can be run and seen to fail.

use partwise::mechanics::paper::{BodyForce, Clearance, Contactless, Cosine, LineForce, PaperOptions, Volume};

/// What `--help` says of them.
pub(crate) const HELP: &str = "\
Readings of equations (2) to (9) for `paper`, the default first:
volume=area|cuboid, cosine=absolute|signed|in-surface, clearance=plus-thickness|literal, contactless=as-equation-6|as-printed, \
body-force=balance|N/m³, line-force=membrane|N/m⁵, contact-distance=0.5 (cm)";

/// One `KEY=VALUE`.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Reading {
    Volume(Volume),
    Cosine(Cosine),
    Clearance(Clearance),
    Contactless(Contactless),
    BodyForce(BodyForce),
    LineForce(LineForce),
    ContactDistance(f64),
}

/// Reads one `KEY=VALUE`.
pub(crate) fn parse(text: &str) -> Result<Reading, String> {
    let (key, value) = text.split_once('=').ok_or("expected KEY=VALUE, e.g. cosine=signed")?;
    let number = || value.parse::<f64>().ok().filter(|x| x.is_finite() && *x >= 0.0);
    Ok(match (key, value) {
        ("volume", "area") => Reading::Volume(Volume::AreaTimesThickness),
        ("volume", "cuboid") => Reading::Volume(Volume::Cuboid),
        ("cosine", "absolute") => Reading::Cosine(Cosine::Absolute),
        ("cosine", "signed") => Reading::Cosine(Cosine::Signed),
        ("cosine", "in-surface") => Reading::Cosine(Cosine::InSurface),
        ("clearance", "plus-thickness") => Reading::Clearance(Clearance::PlusThickness),
        ("clearance", "literal") => Reading::Clearance(Clearance::Literal),
        ("contactless", "as-equation-6") => Reading::Contactless(Contactless::AsEquation6),
        ("contactless", "as-printed") => Reading::Contactless(Contactless::AsPrinted),
        ("body-force", "balance") => Reading::BodyForce(BodyForce::FromBalance),
        ("line-force", "membrane") => Reading::LineForce(LineForce::FromMembrane),
        ("body-force", _) => Reading::BodyForce(BodyForce::Given(number().ok_or("expected `balance` or a number")?)),
        ("line-force", _) => Reading::LineForce(LineForce::Given(number().ok_or("expected `membrane` or a number")?)),
        ("contact-distance", _) => {
            Reading::ContactDistance(number().ok_or("expected a distance in centimetres")? / 100.0)
        }
        _ => return Err(HELP.to_owned()),
    })
}

/// The default readings with the given ones over them.
pub(crate) fn options(readings: &[Reading]) -> PaperOptions {
    let mut options = PaperOptions::default();
    for reading in readings {
        match *reading {
            Reading::Volume(x) => options.volume = x,
            Reading::Cosine(x) => options.cosine = x,
            Reading::Clearance(x) => options.clearance = x,
            Reading::Contactless(x) => options.contactless = x,
            Reading::BodyForce(x) => options.body_force = x,
            Reading::LineForce(x) => options.line_force = x,
            Reading::ContactDistance(x) => options.contact_distance_m = x,
        }
    }
    options
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn readings_are_read_and_others_refused() {
        let some = ["cosine=signed", "contact-distance=1.5", "body-force=12"].map(|t| parse(t).unwrap());
        let options = options(&some);
        assert_eq!(options.cosine, Cosine::Signed);
        assert_eq!(options.contact_distance_m, 0.015);
        assert_eq!(options.body_force, BodyForce::Given(12.0));
        assert_eq!(options.volume, Volume::default());
        for wrong in ["cosine", "cosine=sine", "tangent=1", "body-force=much", "contact-distance=-1"] {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
    }
}
