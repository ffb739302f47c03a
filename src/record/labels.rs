//! Names beside dots: each where it covers no dot and no other name, with a line to its dot where that is not next to it.
//!
//! Spots are tried from near to far, below and above, right and left; the first free one is taken. Lengths are in units of
//! the picture, y upwards.
//!
//! Limits: the viewer's texts have one size on screen, so that what is free when the recording opens need not be after
//! zooming out. Widths are estimated from the number of letters.

use std::ops::Range;

/// Width of a letter and height of a line of text, the viewer's box around it included.
const LETTER: f64 = 3.5;
const LINE: f64 = 12.5;
/// Air between the box and the text's ends, both sides together.
const BOX: f64 = 6.0;
/// How far below its anchor the viewer begins a text's box.
const DROP: f64 = 0.5;
/// Distance of the beads that stand for a line.
const BEAD: f64 = 2.0;
/// Rings of spots around a dot.
const RINGS: i32 = 9;

/// A rectangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Rect {
    pub(super) low: [f64; 2],
    pub(super) high: [f64; 2],
}

impl Rect {
    fn around([x, y]: [f64; 2], [width, height]: [f64; 2]) -> Self {
        Self { low: [x - 0.5 * width, y - 0.5 * height], high: [x + 0.5 * width, y + 0.5 * height] }
    }

    fn overlaps(&self, other: &Self) -> bool {
        (0..2).all(|i| self.low[i] < other.high[i] && other.low[i] < self.high[i])
    }

    fn within(&self, other: &Self) -> bool {
        (0..2).all(|i| self.low[i] >= other.low[i] && self.high[i] <= other.high[i])
    }

    /// Its point nearest to `p`.
    fn nearest(&self, p: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|i| p[i].clamp(self.low[i], self.high[i]))
    }
}

/// Where a name goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Spot {
    /// The point the viewer hangs the text under.
    pub(super) anchor: [f64; 2],
    /// Where the line from the dot ends, if there is to be one.
    pub(super) leader: Option<[f64; 2]>,
}

/// The names placed so far.
#[derive(Debug)]
pub(super) struct Labels {
    frame: Rect,
    dots: Vec<Rect>,
    names: Vec<Rect>,
    lines: Vec<Rect>,
    radius: f64,
}

impl Labels {
    /// No names yet, inside `frame`, among dots of this radius.
    pub(super) fn new(frame: Rect, dots: impl Iterator<Item = [f64; 2]>, radius: f64) -> Self {
        let dots = dots.map(|dot| Rect::around(dot, [2.0 * radius; 2])).collect();
        Self { frame, dots, names: Vec::new(), lines: Vec::new(), radius }
    }

    /// Finds room for the name of a dot; `None` where there is none. Lines cross nothing as long as there is room; in a crowd
    /// they run under names.
    pub(super) fn place(&mut self, dot: [f64; 2], name: &str) -> Option<Spot> {
        let size = [LETTER * name.chars().count() as f64 + BOX, LINE];
        let free = |rect: &Rect| !self.dots.iter().chain(&self.names).any(|other| rect.overlaps(other));
        let off_lines = |rect: &Rect| !self.lines.iter().any(|other| rect.overlaps(other));
        let fits = |rect: &Rect| rect.within(&self.frame) && free(rect);
        let tidy = |rect: &Rect| off_lines(rect) && self.leader(dot, rect).iter().all(|b| free(b) && off_lines(b));
        let spots = |rings| self.spots(dot, size, rings).filter(fits);
        let next_to = spots(0..1).find(off_lines);
        let tidily = || spots(1..RINGS).find(tidy);
        let rect = next_to.or_else(tidily).or_else(|| spots(1..RINGS).next())?;
        let leader = next_to.is_none().then(|| rect.nearest(dot));
        if leader.is_some() {
            let beads = self.leader(dot, &rect);
            self.lines.extend(beads);
        }
        self.names.push(rect);
        Some(Spot { anchor: [0.5 * (rect.low[0] + rect.high[0]), rect.high[1] + DROP], leader })
    }

    /// The spots around a dot, ring by ring.
    fn spots(&self, dot: [f64; 2], size: [f64; 2], rings: Range<i32>) -> impl Iterator<Item = Rect> + Clone {
        let radius = self.radius + 1.0;
        rings.flat_map(move |ring| {
            let far = f64::from(ring) * 0.8 * LINE;
            let (aside, above) = (0.5 * size[0] + radius + far, 0.5 * LINE + radius + far);
            let half = 0.5 * aside;
            [[0.0, -above], [aside, 0.0], [0.0, above], [-aside, 0.0]]
                .into_iter()
                .chain([[half, -above], [-half, -above], [half, above], [-half, above]])
                .chain([[aside, -above], [-aside, -above], [aside, above], [-aside, above]])
                .map(move |[x, y]| Rect::around([dot[0] + x, dot[1] + y], size))
        })
    }

    /// The line from a dot to its name as beads, those on either left out.
    fn leader(&self, dot: [f64; 2], name: &Rect) -> Vec<Rect> {
        let end = name.nearest(dot);
        let length = (end[0] - dot[0]).hypot(end[1] - dot[1]);
        let beads = (length / BEAD).floor();
        (1..beads as i32)
            .map(|i| f64::from(i) / beads)
            .filter(|along| along * length > self.radius + BEAD)
            .map(|along| Rect::around([0, 1].map(|i| dot[i] + along * (end[i] - dot[i])), [0.5 * BEAD; 2]))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: Rect = Rect { low: [0.0, 0.0], high: [400.0, 170.0] };

    #[test]
    fn a_lone_name_hangs_under_its_dot_and_a_crowd_keeps_apart() {
        let mut alone = Labels::new(FRAME, [[200.0, 100.0]].into_iter(), 2.0);
        let spot = alone.place([200.0, 100.0], "table-3").unwrap();
        assert_eq!(spot.anchor[0], 200.0);
        assert!(spot.anchor[1] < 98.0 && spot.leader.is_none());

        let dots: Vec<[f64; 2]> = (0..8).map(|i| [200.0 + 3.0 * f64::from(i), 90.0 + f64::from(i % 3)]).collect();
        let mut labels = Labels::new(FRAME, dots.iter().copied(), 2.0);
        let spots: Vec<Spot> = dots.iter().filter_map(|&dot| labels.place(dot, "table-3 x0.75")).collect();
        assert_eq!(spots.len(), 8, "there is room for all");
        assert!(spots.iter().any(|s| s.leader.is_some()));
        for (i, a) in labels.names.iter().enumerate() {
            assert!(a.within(&FRAME));
            assert!(labels.dots.iter().chain(&labels.names[..i]).all(|b| !a.overlaps(b)));
        }
    }

    #[test]
    fn without_room_a_name_is_left_out() {
        let mut labels = Labels::new(Rect { low: [0.0; 2], high: [20.0; 2] }, [[10.0; 2]].into_iter(), 2.0);
        assert!(labels.place([10.0; 2], "far too long a name").is_none());
    }
}
