//! Result of the release of held edges: see [`released_drape`](super::released_drape).

/// A waist that sinks farther than this slides, m: from the waist to the hips it is twice as far.
pub(super) const MAX_SINK_M: f64 = 0.1;

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
        /// How far what was held had sunk when that was clear, m; less if it had neither slid nor come to rest after the most steps.
        sank_m: f64,
        /// Whether a coarser mesh of the garment slid, so that it was not released at full resolution.
        is_coarse: bool,
    },
}

impl std::fmt::Display for Release {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Stays { sank_m } => {
                write!(f, "stays up by itself: released, its waist sank {:.1} mm", 1e3 * sank_m)
            }
            Self::Slides { sank_m, .. } if *sank_m <= MAX_SINK_M => write!(
                f,
                "is not known to stay up by itself: released, it did not come to rest, and its waist sank {:.1} mm; it is shown held",
                1e3 * sank_m
            ),
            Self::Slides { sank_m, is_coarse } => write!(
                f,
                "does not stay up by itself: released{}, its waist sank {:.1} mm and went on; it is shown held. A narrower waist or \
                 a fabric of more friction would carry it",
                if *is_coarse { " on a coarser mesh" } else { "" },
                1e3 * sank_m
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_garment_that_neither_slid_nor_rested_is_not_said_to_slide() {
        let text = |sank_m| Release::Slides { sank_m, is_coarse: false }.to_string();
        assert!(text(0.15).contains("sank 150.0 mm and went on"), "{}", text(0.15));
        assert!(text(0.02).contains("not known to stay up by itself"), "{}", text(0.02));
        assert!(!text(0.02).contains("went on"));
    }
}
