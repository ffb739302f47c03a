//! Smooth curves through a few stations: how a section's sizes change along a limb or the trunk.
//!
//! Between stations s_i < s_{i+1} each channel is the cubic Hermite polynomial with the values of the two stations and
//! tangents of the parabola through three neighbouring stations (Bessel's; de Boor, "A Practical Guide to Splines", ch.
//! IV), so the curve is C¹ and reproduces parabolas. Beyond the ends it is constant.

use super::jet::Jet;

/// One segment: its start, length and the four coefficients of each channel.
#[derive(Debug, Clone)]
struct Segment<const K: usize> {
    start: f64,
    coefficients: [[f64; 4]; K],
}

/// K channels as functions of one coordinate.
#[derive(Debug, Clone)]
pub(crate) struct Profile<const K: usize> {
    segments: Vec<Segment<K>>,
    first: f64,
    last: f64,
}

impl<const K: usize> Profile<K> {
    /// The curve through `stations` (coordinate, values); coordinates must ascend. Fewer than two stations make a
    /// constant.
    pub(crate) fn new(stations: &[(f64, [f64; K])]) -> Self {
        let n = stations.len();
        let slope = |i: usize, c: usize| -> f64 {
            (stations[i + 1].1[c] - stations[i].1[c]) / (stations[i + 1].0 - stations[i].0)
        };
        let tangent = |i: usize, c: usize| -> f64 {
            if n < 2 {
                0.0
            } else if i == 0 {
                slope(0, c)
            } else if i == n - 1 {
                slope(n - 2, c)
            } else {
                let (before, after) = (stations[i].0 - stations[i - 1].0, stations[i + 1].0 - stations[i].0);
                (slope(i - 1, c) * after + slope(i, c) * before) / (before + after)
            }
        };
        let segments = (0..n.saturating_sub(1))
            .map(|i| {
                let h = stations[i + 1].0 - stations[i].0;
                let coefficients = std::array::from_fn(|c| {
                    let (p, s, m0, m1) = (stations[i].1[c], slope(i, c), tangent(i, c), tangent(i + 1, c));
                    [p, m0, (3.0 * s - 2.0 * m0 - m1) / h, (m0 + m1 - 2.0 * s) / (h * h)]
                });
                Segment { start: stations[i].0, coefficients }
            })
            .collect();
        Self { segments, first: stations.first().map_or(0.0, |s| s.0), last: stations.last().map_or(0.0, |s| s.0) }
    }

    /// Whether each station's coordinate is above the one before.
    pub(super) fn ascends(&self) -> bool {
        let starts = self.segments.iter().map(|segment| segment.start);
        starts.chain([self.last]).is_sorted_by(|a, b| a < b)
    }

    /// First and last coordinate.
    pub(crate) fn range(&self) -> (f64, f64) {
        (self.first, self.last)
    }

    /// All channels at `s`, with gradients.
    pub(crate) fn at(&self, s: Jet) -> [Jet; K] {
        let clamped = s.value.clamp(self.first, self.last);
        let slope = if clamped == s.value { s.gradient } else { glam::DVec3::ZERO };
        let index = self.segments.partition_point(|g| g.start <= clamped).saturating_sub(1);
        let Some(segment) = self.segments.get(index) else { return [Jet::constant(0.0); K] };
        let x = clamped - segment.start;
        std::array::from_fn(|c| {
            let [p0, p1, p2, p3] = segment.coefficients[c];
            Jet::new(p0 + x * (p1 + x * (p2 + x * p3)), slope * (p1 + x * (2.0 * p2 + x * 3.0 * p3)))
        })
    }

    /// All channels at `s`.
    pub(crate) fn values(&self, s: f64) -> [f64; K] {
        self.at(Jet::constant(s)).map(|j| j.value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_reproduces_parabolas_inside_and_stays_constant_beyond() {
        let stations: Vec<(f64, [f64; 1])> = [0.0, 1.0, 2.5, 3.0, 4.0].iter().map(|&s| (s, [s * s])).collect();
        let profile = Profile::new(&stations);
        assert!((profile.values(1.7)[0] - 1.7 * 1.7).abs() < 1e-12);
        assert!((profile.values(2.8)[0] - 2.8 * 2.8).abs() < 1e-12);
        assert_eq!(profile.values(9.0), [16.0]);
        assert_eq!(profile.values(-1.0), [0.0]);
    }
}
