//! Result of the release of held edges: see [`released_drape`](super::released_drape).

/// Result of the release.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Release {
    /// It rests without being held.
    Stays {
        /// How far what was held has sunk, m.
        sank_m: f64,
    },
    /// It does not, and stays held.
    Slides {
        /// How far what was held had sunk when that was clear, m.
        sank_m: f64,
        /// Whether a coarser mesh of the garment slid, so that it was not released at full resolution.
        is_coarse: bool,
    },
    /// It neither slid nor converged within the step limit, and stays held.
    Unsettled {
        /// How far what was held had sunk, m.
        sank_m: f64,
    },
}

impl std::fmt::Display for Release {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Stays { sank_m } => {
                write!(f, "stays up by itself: released, its waist sank {:.1} mm", 1e3 * sank_m)
            }
            Self::Slides { sank_m, is_coarse } => write!(
                f,
                "does not stay up by itself: released{}, its waist sank {:.1} mm and went on; it is shown held. A narrower waist or \
                 a fabric of more friction would carry it",
                if *is_coarse { " on a coarser mesh" } else { "" },
                1e3 * sank_m
            ),
            Self::Unsettled { sank_m } => write!(
                f,
                "is not known to stay up by itself: released, it did not settle, and its waist sank {:.1} mm; it is shown held",
                1e3 * sank_m
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_garment_that_did_not_settle_is_not_reported_as_sliding() {
        let slides = Release::Slides { sank_m: 0.15, is_coarse: false }.to_string();
        let unsettled = Release::Unsettled { sank_m: 0.02 }.to_string();
        assert!(slides.contains("sank 150.0 mm and went on"), "{slides}");
        assert!(unsettled.contains("not known to stay up by itself"), "{unsettled}");
        assert!(!unsettled.contains("went on"));
    }
}
