//! Colours from lightness, chroma and hue, and the maps that turn a value into one.
//!
//! OKLab: B. Ottosson, "A perceptual color space for image processing" (2020). With L the lightness (0–1), C the chroma and
//! h the hue (degrees): a = C cos h, b = C sin h; (l, m, s)^⅓ = M₁ (L, a, b); linear RGB = M₂ (l, m, s), then the sRGB curve.
//! Equal steps of L are perceived as equal steps of brightness, so a map whose L rises evenly has no false borders.
//!
//! Limits: a colour outside sRGB is clipped channel by channel.

use crate::base::quantiles::nearest_rank;

/// An sRGB colour.
pub(crate) type Rgb = [u8; 3];

/// sRGB of OKLCH: lightness 0–1, chroma (0–0.3), hue in degrees.
pub(crate) fn oklch(lightness: f64, chroma: f64, hue_deg: f64) -> Rgb {
    let (sin, cos) = hue_deg.to_radians().sin_cos();
    oklab(lightness, chroma * cos, chroma * sin)
}

/// sRGB of OKLab.
pub(crate) fn oklab(lightness: f64, a: f64, b: f64) -> Rgb {
    let l = (lightness + 0.396_337_777_4 * a + 0.215_803_757_3 * b).powi(3);
    let m = (lightness - 0.105_561_345_8 * a - 0.063_854_172_8 * b).powi(3);
    let s = (lightness - 0.089_484_177_5 * a - 1.291_485_548_0 * b).powi(3);
    [
        4.076_741_662_1 * l - 3.307_711_591_3 * m + 0.230_969_929_2 * s,
        -1.268_438_004_6 * l + 2.609_757_401_1 * m - 0.341_319_396_5 * s,
        -0.004_196_086_3 * l - 0.703_418_614_7 * m + 1.707_614_701_0 * s,
    ]
    .map(gamma)
}

/// The sRGB transfer curve (IEC 61966-2-1), rounded to 8 bits.
fn gamma(linear: f64) -> u8 {
    let v = if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
    (v.clamp(0.0, 1.0) * 255.0).round() as u8
}

/// A colour map: lightness and hue change linearly.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ColourMap {
    lightness: (f64, f64),
    hue_deg: (f64, f64),
    chroma: (f64, f64),
}

impl ColourMap {
    /// Dark blue over teal to yellow: distances.
    pub(crate) const DISTANCE: Self = Self { lightness: (0.34, 0.93), hue_deg: (285.0, 102.0), chroma: (0.155, 0.155) };
    /// Dark violet over red to pale yellow: forces.
    pub(crate) const FORCE: Self = Self { lightness: (0.34, 0.95), hue_deg: (295.0, 460.0), chroma: (0.175, 0.175) };
    /// Pale grey over orange to dark red: errors, strains and pressures.
    pub(crate) const ALARM: Self = Self { lightness: (0.96, 0.45), hue_deg: (85.0, 20.0), chroma: (0.015, 0.19) };

    /// The colour at `t` in 0–1; beyond them that of the end, and grey for NaN.
    pub(crate) fn at(&self, t: f64) -> Rgb {
        if t.is_nan() {
            return [128, 128, 128];
        }
        let t = t.clamp(0.0, 1.0);
        let mix = |(a, b): (f64, f64)| a + (b - a) * t;
        // Near both ends of the lightness sRGB has less chroma; without this factor the ends would clip to another hue.
        let lightness = mix(self.lightness);
        let room = 1.0 - ((lightness - 0.66) / 0.42).powi(4);
        oklch(lightness, mix(self.chroma) * room.max(0.25), mix(self.hue_deg))
    }

    /// The colours of values over `range`.
    pub(crate) fn colours(&self, values: &[f64], range: Range) -> Vec<Rgb> {
        values.iter().map(|&v| self.at(range.position(v))).collect()
    }
}

/// The values at the two ends of a colour map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Range {
    /// Value of the first colour.
    pub(crate) low: f64,
    /// Value of the last colour.
    pub(crate) high: f64,
}

impl Range {
    /// From zero to a round number at or above the `share` quantile of the finite values (1.0 = the largest). With a few outliers
    /// above it, such as a PART of one vertex, the others still have different colours.
    pub(crate) fn to_quantile(values: impl IntoIterator<Item = f64>, share: f64) -> Self {
        let finite: Vec<f64> = values.into_iter().filter(|v| v.is_finite()).collect();
        Self { low: 0.0, high: round_up(nearest_rank(&finite, share)) }
    }

    /// Relative position of `value`: 0 at the low end, 1 at the high end.
    fn position(&self, value: f64) -> f64 {
        (value - self.low) / (self.high - self.low)
    }
}

/// The next of 1, 1.5, 2, 2.5, 3, 4, 5, 6, 8 × 10ⁿ at or above `value`; 1 if it is not positive.
fn round_up(value: f64) -> f64 {
    if value.is_nan() || value <= 0.0 {
        return 1.0;
    }
    let decade = 10f64.powf(value.log10().floor());
    [1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0]
        .into_iter()
        .map(|m| m * decade)
        .find(|&candidate| candidate >= value * (1.0 - 1e-9))
        .unwrap_or(10.0 * decade)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn oklab_gives_white_black_and_srgb_red() {
        assert_eq!(oklab(1.0, 0.0, 0.0), [255, 255, 255]);
        assert_eq!(oklab(0.0, 0.0, 0.0), [0, 0, 0]);
        // OKLab of sRGB red, from Ottosson's page: L 0.628, a 0.2249, b 0.1258.
        assert_eq!(oklab(0.627_96, 0.224_86, 0.125_85), [255, 0, 0]);
    }

    #[test]
    fn maps_rise_evenly_in_luminance() {
        let luminance = |c: Rgb| {
            let linear = c.map(|v| (f64::from(v) / 255.0).powf(2.2));
            (0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]).cbrt()
        };
        for map in [ColourMap::DISTANCE, ColourMap::FORCE] {
            let steps: Vec<f64> = (0..=16).map(|i| luminance(map.at(f64::from(i) / 16.0))).collect();
            for pair in steps.windows(2) {
                assert!(pair[1] > pair[0] + 0.01, "{map:?} {steps:?}");
            }
        }
    }

    #[test]
    fn ranges_end_on_round_numbers() {
        assert_eq!(Range::to_quantile([0.3, 7.2, 1.0], 1.0), Range { low: 0.0, high: 8.0 });
        assert_eq!(Range::to_quantile([0.012], 1.0).high, 0.015);
        assert_eq!(Range::to_quantile([], 1.0).high, 1.0);
        assert_eq!(Range::to_quantile([f64::NAN, 2.0], 1.0).high, 2.0);
    }
}
