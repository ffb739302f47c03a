//! Measurements of the European sizes, and the grading of a body from bust, waist and hip.
//!
//! Bust, waist and hip of a size are those of EN 13402-3 for women: 4 cm from size to size up to 46, beyond it 6 cm at bust and waist
//! and 5 cm at the hip. The other girths lie on the line through two bodies of the same survey (ANSUR II, women, n = 1,986): size 38, and
//! the mean body, whose bust and hip are 6.7 and 6.1 cm larger.
//!
//! girth = girth₃₈ + slope (bust − 88)  or  girth₃₈ + slope (hip − 96), cm
//!
//! Limits: stature and heights do not change with the size, and shapes other than the survey's mean have other girths.

use super::measures::BodySpec;

/// Bust, waist and hip of each size, cm.
const EU_SIZES: [(u32, [f64; 3]); 11] = [
    (32, [76.0, 60.0, 84.0]),
    (34, [80.0, 64.0, 88.0]),
    (36, [84.0, 68.0, 92.0]),
    (38, [88.0, 72.0, 96.0]),
    (40, [92.0, 76.0, 100.0]),
    (42, [96.0, 80.0, 104.0]),
    (44, [100.0, 84.0, 108.0]),
    (46, [104.0, 88.0, 112.0]),
    (48, [110.0, 94.0, 117.0]),
    (50, [116.0, 100.0, 122.0]),
    (52, [122.0, 106.0, 127.0]),
];

/// Differences of the mean body from size 38, cm: bust, and neck, biceps and wrist, which follow it.
const MEAN_BUST: f64 = 94.7 - 88.0;
const BY_BUST: [f64; 3] = [33.0 - 31.7, 30.6 - 27.9, 15.5 - 15.4];
/// The same: hip, and thigh, knee, calf and ankle, which follow it.
const MEAN_HIP: f64 = 102.1 - 96.0;
const BY_HIP: [f64; 4] = [61.6 - 57.0, 37.3 - 36.1, 37.3 - 36.1, 21.6 - 21.3];

impl BodySpec {
    /// The European size of this number, women; `None` for a number that is no size from 32 to 52.
    #[must_use]
    pub fn eu_size(size: u32) -> Option<Self> {
        let (_, girths) = EU_SIZES.iter().find(|(number, _)| *number == size)?;
        Some(Self::default().graded(*girths))
    }

    /// The same body with these girths of bust, waist and hip, cm, and its other girths graded to them.
    #[must_use]
    pub fn graded(&self, [bust_cm, waist_cm, hip_cm]: [f64; 3]) -> Self {
        let (by_bust, by_hip) = ((bust_cm - self.bust_cm) / MEAN_BUST, (hip_cm - self.hip_cm) / MEAN_HIP);
        let [neck, biceps, wrist] = BY_BUST.map(|more| by_bust * more);
        let [thigh, knee, calf, ankle] = BY_HIP.map(|more| by_hip * more);
        Self {
            bust_cm,
            waist_cm,
            hip_cm,
            // The same cup.
            underbust_cm: self.underbust_cm + bust_cm - self.bust_cm,
            neck_cm: self.neck_cm + neck,
            biceps_cm: self.biceps_cm + biceps,
            wrist_cm: self.wrist_cm + wrist,
            thigh_cm: self.thigh_cm + thigh,
            knee_cm: self.knee_cm + knee,
            calf_cm: self.calf_cm + calf,
            ankle_cm: self.ankle_cm + ankle,
            ..self.clone()
        }
    }

    /// The numbers of the European sizes.
    pub(crate) fn eu_sizes() -> impl Iterator<Item = u32> {
        EU_SIZES.iter().map(|(number, _)| *number)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_grade_through_size_38_and_the_mean_body() {
        assert_eq!(BodySpec::eu_size(38), Some(BodySpec::default()));
        assert_eq!(BodySpec::eu_size(39), None);
        let mean = BodySpec::default().graded([94.7, 86.1, 102.1]);
        for (found, expected) in [
            (mean.neck_cm, 33.0),
            (mean.biceps_cm, 30.6),
            (mean.thigh_cm, 61.6),
            (mean.calf_cm, 37.3),
            (mean.underbust_cm, 81.7),
        ] {
            assert!((found - expected).abs() < 1e-9, "{found} {expected}");
        }
    }

    #[test]
    fn every_size_makes_a_body_with_its_girths() {
        for number in BodySpec::eu_sizes() {
            let spec = BodySpec::eu_size(number).unwrap();
            let measures = spec.measures().unwrap();
            assert!((100.0 * measures.bust - spec.bust_cm).abs() < 1e-9, "{number}");
        }
        for number in [32, 52] {
            assert!(crate::body::dress_form(&BodySpec::eu_size(number).unwrap()).is_ok(), "{number}");
        }
    }
}
