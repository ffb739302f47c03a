//! Colour bars: colours with numbers and unit, and the hues of levels. Recordings and pictures draw the same ones.

use super::map::{ColourMap, Range, Rgb};
use super::palette::level_colours;
use crate::study::metrics::LevelCount;

/// Number of colours in a bar.
pub(crate) const BANDS: usize = 48;

/// A colour bar as it is drawn.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ColourBar {
    /// Quantity and unit.
    pub(crate) title: String,
    /// Colours from the first to the last, [`BANDS`] of them.
    pub(crate) bands: Vec<Rgb>,
    /// Numbers, with their positions along the bar from 0 to 1.
    pub(crate) ticks: Vec<(f64, String)>,
}

/// The colours of a bar, by position along it.
fn bands(colour_at: impl Fn(f64) -> Rgb) -> Vec<Rgb> {
    (0..BANDS).map(|band| colour_at((band as f64 + 0.5) / BANDS as f64)).collect()
}

/// The legend of a colour map.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Legend<'a> {
    /// Quantity.
    pub(crate) title: &'a str,
    /// Unit of the numbers.
    pub(crate) unit: &'a str,
    /// The map.
    pub(crate) map: ColourMap,
    /// The numbers at its ends.
    pub(crate) range: Range,
    /// Whether there are values beyond the upper end, which have its colour: the last number then has a "≥".
    pub(crate) open_end: bool,
}

impl<'a> Legend<'a> {
    /// The legend of values over `range`.
    pub(crate) fn new(title: &'a str, unit: &'a str, map: ColourMap, range: Range, values: &[f64]) -> Self {
        Self { title, unit, map, range, open_end: values.iter().any(|&v| v > range.high) }
    }

    /// The bar.
    pub(crate) fn bar(&self) -> ColourBar {
        let title = format!("{}, {}", self.title, self.unit);
        ColourBar { title, bands: bands(|t| self.map.at(t)), ticks: self.ticks() }
    }

    /// The numbers, with their positions along the bar; only three if more would overlap.
    fn ticks(&self) -> Vec<(f64, String)> {
        let divided = |steps: u32| -> Vec<(f64, String)> {
            let all = (0..=steps).map(|tick| {
                let t = f64::from(tick) / f64::from(steps);
                let bound = if self.open_end && tick == steps { "≥" } else { "" };
                (t, format!("{bound}{}", number(self.range.low + t * (self.range.high - self.range.low))))
            });
            all.collect()
        };
        let round = divided(steps(self.range.high));
        let widest = round.windows(2).map(|two| 0.5 * (width(&two[0].1) + width(&two[1].1))).fold(0.0, f64::max);
        if widest * (round.len() - 1) as f64 > MAX_DIGITS { divided(2) } else { round }
    }
}

/// Digits that fit below a bar, in a window 1280 pixels wide, where four drawings stand side by side.
const MAX_DIGITS: f64 = 12.0;

/// Bounds that are named below the bar of the levels.
const NAMED_LEVELS: usize = 5;

/// The hues of the occupied levels, from the nearest to the farthest, with the distances at which some of them begin, cm. `None` where no
/// level has vertices.
pub(crate) fn level_bar(levels: &[LevelCount]) -> Option<ColourBar> {
    let colours = level_colours(levels);
    let occupied: Vec<(&LevelCount, Rgb)> =
        levels.iter().zip(colours).filter(|(level, _)| level.vertices > 0).collect();
    let count = occupied.len();
    let hue = |t: f64| occupied[((t * count as f64) as usize).min(count - 1)].1;
    let ticks = level_ticks(&occupied);
    (count > 0).then(|| ColourBar { title: "level, cm".to_owned(), bands: bands(hue), ticks })
}

/// Where the named levels begin along the bar, and their lower bounds; fewer if they would overlap. The last level is always named.
fn level_ticks(occupied: &[(&LevelCount, Rgb)]) -> Vec<(f64, String)> {
    let count = occupied.len();
    let tick = |i: usize| {
        // Rounded to a tenth of a millimetre: a scaled bound has many digits.
        let cm = (100.0 * occupied[i].0.lower_cm).round() / 100.0;
        (i as f64 / count as f64, number(cm))
    };
    // Evenly spaced, rounded to whole levels.
    let index = |i: usize, last: usize| if last == 0 { 0 } else { (2 * i * (count - 1) + last) / (2 * last) };
    let named = |number: usize| (0..number).map(|i| tick(index(i, number - 1))).collect::<Vec<_>>();
    let apart =
        |two: &[(f64, String)]| MAX_DIGITS * (two[1].0 - two[0].0) >= 0.5 * (width(&two[0].1) + width(&two[1].1));
    let most = count.min(NAMED_LEVELS);
    let fitting = (3..=most).rev().map(named).find(|ticks| ticks.windows(2).all(apart));
    fitting.unwrap_or_else(|| named(most.min(2)))
}

/// Width of a number, in digits.
fn width(label: &str) -> f64 {
    label.chars().map(|c| if c == '.' { 0.5 } else { 1.0 }).sum()
}

/// The number of steps from zero to a round number such that each step is round.
fn steps(high: f64) -> u32 {
    let mantissa = high / 10f64.powf(high.log10().floor());
    match (2.0 * mantissa).round() as u32 {
        3 | 6 | 12 => 3,
        5 | 10 => 5,
        _ => 4,
    }
}

/// Three significant digits, without trailing zeros.
pub(crate) fn number(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let digits = (2 - value.abs().log10().floor() as i32).clamp(0, 9) as usize;
    if digits == 9 {
        return format!("{value:.2e}");
    }
    let text = format!("{value:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round() {
        for (high, expected) in
            [(1.0, 4), (1.5, 3), (2.0, 4), (2.5, 5), (30.0, 3), (0.4, 4), (5.0, 5), (0.6, 3), (80.0, 4)]
        {
            assert_eq!(steps(high), expected, "{high}");
        }
    }

    #[test]
    fn ticks_do_not_overlap() {
        let ticks = |high: f64, open_end: bool| {
            let range = Range { low: 0.0, high };
            let legend = Legend { title: "error", unit: "mm", map: ColourMap::ALARM, range, open_end };
            legend.ticks().into_iter().map(|tick| tick.1).collect::<Vec<_>>().join(" ")
        };
        assert_eq!(ticks(25.0, false), "0 5 10 15 20 25");
        assert_eq!(ticks(2.5, false), "0 0.5 1 1.5 2 2.5");
        assert_eq!(ticks(25.0, true), "0 12.5 ≥25");
        assert_eq!(ticks(250.0, true), "0 125 ≥250");
        assert_eq!(ticks(300.0, true), "0 100 200 ≥300");
    }

    #[test]
    fn hues_are_named_by_the_distances_at_which_their_levels_begin() {
        let level =
            |i: usize| LevelCount { level: i + 1, lower_cm: 0.5 * i as f64, vertices: 1, ..LevelCount::default() };
        let ticks = |count: usize| {
            let levels: Vec<LevelCount> = (0..count).map(level).collect();
            let occupied: Vec<(&LevelCount, Rgb)> = levels.iter().map(|level| (level, [0; 3])).collect();
            level_ticks(&occupied)
        };
        assert_eq!(ticks(1), [(0.0, "0".to_owned())]);
        assert_eq!(ticks(2), [(0.0, "0".to_owned()), (0.5, "0.5".to_owned())]);
        let many = ticks(12);
        assert_eq!(many.len(), NAMED_LEVELS);
        assert_eq!(many.last(), Some(&(11.0 / 12.0, "5.5".to_owned())));
        // The numbers of Table 3 have room below their bar; long ones are fewer.
        let named = |lower_cm: &[f64]| {
            let levels = lower_cm.iter().map(|&lower_cm| LevelCount { lower_cm, ..LevelCount::default() });
            let levels: Vec<LevelCount> = levels.collect();
            let occupied: Vec<(&LevelCount, Rgb)> = levels.iter().map(|level| (level, [0; 3])).collect();
            level_ticks(&occupied).into_iter().map(|tick| tick.1).collect::<Vec<_>>().join(" ")
        };
        let table_3 = [0.5, 1.0, 1.25, 1.75, 2.0, 2.5, 3.5, 4.5, 7.0, 9.0, 10.0, 11.0];
        assert_eq!(named(&table_3), "0.5 1.75 3.5 7 11");
        assert_eq!(named(&[0.01, 10.25, 10.75, 11.25, 12.75, 13.25]), "0.01 11.2 13.2");
    }

    #[test]
    fn numbers_have_three_digits() {
        for (value, text) in [
            (0.0, "0"),
            (1.25, "1.25"),
            (12.5, "12.5"),
            (2500.0, "2500"),
            (0.015, "0.015"),
            (3.0, "3"),
            (1e-9, "1.00e-9"),
        ] {
            assert_eq!(number(value), text);
        }
    }
}
