//! Figures in rows with a title, captions and colour bars, at one scale.

use std::io;

use super::figure::Figure;
use super::text::{Pixels, Size};
use crate::picture::colour::legend::ColourBar;

/// Largest number of figures, and the height of each of them, pixels.
const HEIGHTS: [(usize, usize); 3] = [(6, 720), (16, 480), (usize::MAX, 320)];
/// Space between figures and around all, pixels.
const GAP: usize = 24;
/// Least width of a figure, pixels: a colour bar with its numbers fits.
const MIN_WIDTH: usize = 300;
/// Thickness of a colour bar, pixels.
const BAR: usize = 16;
/// Most pixels of a sheet; larger ones get smaller figures.
const MAX_PIXELS: f64 = 4e7;

/// Figures in rows.
#[derive(Debug, Clone)]
pub(crate) struct Sheet<'a> {
    pub(crate) title: String,
    pub(crate) rows: Vec<Vec<Figure<'a>>>,
}

impl<'a> Sheet<'a> {
    /// Figures in as many rows as make the sheet about half as wide again as it is high.
    pub(crate) fn arranged(title: String, mut figures: Vec<Figure<'a>>) -> Self {
        let aspect = figures.first().map_or(1.0, |figure| {
            let half = figure.frame().half;
            half.x / half.y
        });
        let columns = (1.5 * figures.len() as f64 / aspect).sqrt().ceil().max(1.0) as usize;
        // Full rows, as far as there are.
        let rows = figures.len().div_ceil(columns).max(1);
        let columns = figures.len().div_ceil(rows).max(1);
        let mut all = Vec::new();
        while figures.len() > columns {
            let rest = figures.split_off(columns);
            all.push(std::mem::replace(&mut figures, rest));
        }
        all.push(figures);
        Self { title, rows: all }
    }

    /// The sheet as PNG; `progress` is called after each figure.
    pub(crate) fn png(&self, progress: &mut dyn FnMut()) -> io::Result<Vec<u8>> {
        self.draw(progress).png()
    }

    fn draw(&self, progress: &mut dyn FnMut()) -> Pixels {
        let figures = || self.rows.iter().flatten();
        let count = figures().count();
        let tallest = figures().map(|figure| figure.frame().half.y).fold(1e-3, f64::max);
        let columns = self.rows.iter().map(Vec::len).max().unwrap_or(0);
        let height = HEIGHTS.iter().find(|(most, _)| count <= *most).map_or(HEIGHTS[2].1, |(_, height)| *height);
        let half_width = |column: usize| {
            let of_column = self.rows.iter().filter_map(|row| row.get(column));
            of_column.map(|figure| figure.frame().half.x).fold(0.0, f64::max)
        };
        // Wide garments and many rows shrink, so that the sheet keeps within its limit.
        let widths_m: f64 = (0..columns).map(half_width).sum();
        let wanted = 0.5 * height as f64 / tallest;
        let area = (2.0 * widths_m * wanted) * (self.rows.len() * height) as f64;
        let scale = wanted * (MAX_PIXELS / area.max(1.0)).sqrt().min(1.0);
        let height = (2.0 * tallest * scale).round().max(1.0) as usize;
        let widths: Vec<usize> =
            (0..columns).map(|column| ((2.0 * half_width(column) * scale).round() as usize).max(MIN_WIDTH)).collect();
        let has_bars = figures().any(|figure| figure.bar.is_some());
        let captions: Vec<Vec<Vec<String>>> = self
            .rows
            .iter()
            .map(|row| {
                row.iter().zip(&widths).map(|(figure, &width)| Size::Caption.wrapped(&figure.caption, width)).collect()
            })
            .collect();
        let lines = captions.iter().flatten().map(Vec::len).max().unwrap_or(0).max(1);
        let caption_height = lines * Size::Caption.height();
        let below = caption_height + 8 + if has_bars { BAR + Size::Tick.height() + 14 } else { 0 };
        let width = widths.iter().sum::<usize>() + GAP * (columns + 1);
        let title = Size::Title.wrapped(&self.title, width.saturating_sub(2 * GAP));
        let top = if title.is_empty() { GAP } else { GAP + title.len() * Size::Title.height() + GAP / 2 };
        let mut sheet = Pixels::white([width, top + self.rows.len() * (height + below + GAP)]);
        for (line, text) in title.iter().enumerate() {
            sheet.write(text, [GAP, GAP + line * Size::Title.height()], Size::Title);
        }
        for (row, (figures, captions)) in self.rows.iter().zip(&captions).enumerate() {
            let top = top + row * (height + below + GAP);
            let mut left = GAP;
            for ((figure, caption), &width) in figures.iter().zip(captions).zip(&widths) {
                sheet.put(&figure.draw([width, height], scale), [left, top]);
                for (line, text) in caption.iter().enumerate() {
                    let inset = width.saturating_sub(Size::Caption.width(text)) / 2;
                    let down = height + 6 + line * Size::Caption.height();
                    sheet.write(text, [left + inset, top + down], Size::Caption);
                }
                if let Some(bar) = &figure.bar {
                    draw_bar(&mut sheet, bar, [left, top + height + caption_height + 14], width);
                }
                left += width + GAP;
                progress();
            }
        }
        sheet
    }
}

/// Draws a colour bar with its title on the left and its numbers below.
fn draw_bar(sheet: &mut Pixels, bar: &ColourBar, [left, top]: [usize; 2], width: usize) {
    let title = Size::Tick.width(&bar.title) + 10;
    let (from, to) = (left + title, left + width.min(title + 320).max(title + 2) - 20);
    let length = to.saturating_sub(from).max(1);
    sheet.write(&bar.title, [left, top], Size::Tick);
    for x in 0..length {
        let colour = bar.bands[(x * bar.bands.len() / length).min(bar.bands.len() - 1)];
        (0..BAR).for_each(|y| sheet.set([from + x, top + y], colour));
    }
    for (at, text) in &bar.ticks {
        let middle = from as f64 + at * length as f64;
        let start = middle - 0.5 * Size::Tick.width(text) as f64;
        sheet.write(text, [start.max(0.0) as usize, top + BAR + 4], Size::Tick);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::cuboid;
    use crate::picture::raster::{Paint, Surface};
    use glam::DVec3;

    #[test]
    fn figures_are_at_one_scale_and_fill_rows() {
        let boxes = [0.2, 0.4].map(|height| cuboid(DVec3::ZERO, DVec3::new(0.2, 0.2, height)));
        let figure = |k: usize| Figure {
            garment: Surface::new(&boxes[k % 2], Paint::Plain([90; 3])),
            body: None,
            toward: DVec3::NEG_Y,
            caption: format!("{k}"),
            bar: None,
        };
        let sheet = Sheet::arranged("boxes".to_owned(), (0..7).map(figure).collect());
        assert_eq!(sheet.rows.iter().map(Vec::len).collect::<Vec<_>>(), [4, 3]);
        let mut drawn = 0;
        let pixels = sheet.draw(&mut || drawn += 1);
        assert_eq!(drawn, 7);
        // 16 figures and fewer: 480 pixels for the height of the taller box.
        let [_, height] = pixels.size;
        assert_eq!(height, GAP + 24 + GAP / 2 + 2 * (480 + 28 + GAP));
        assert!(Sheet::arranged(String::new(), Vec::new()).png(&mut || ()).is_ok());
    }
}
