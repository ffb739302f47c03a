//! Pixels of a sheet, texts on them, and the PNG.

use std::io;

use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster};

use crate::picture::colour::map::Rgb;

/// Colour of texts.
const INK: Rgb = [40, 44, 52];

/// Size of a text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Size {
    Title,
    Caption,
    Tick,
}

impl Size {
    fn raster(self) -> RasterHeight {
        match self {
            Self::Title => RasterHeight::Size24,
            Self::Caption => RasterHeight::Size20,
            Self::Tick => RasterHeight::Size16,
        }
    }

    /// Height of a line, pixels.
    pub(super) fn height(self) -> usize {
        self.raster().val()
    }

    /// Width of a letter, pixels: all letters are equally wide.
    fn letter(self) -> usize {
        noto_sans_mono_bitmap::get_raster_width(FontWeight::Regular, self.raster())
    }

    /// Width of a text, pixels.
    pub(super) fn width(self, text: &str) -> usize {
        text.chars().count() * self.letter()
    }

    /// The text in lines of at most this width, broken at spaces; a longer word is shortened in its middle.
    pub(super) fn wrapped(self, text: &str, width: usize) -> Vec<String> {
        let mut lines: Vec<String> = Vec::new();
        for word in text.split_whitespace().map(|word| self.shortened(word, width)) {
            match lines.last_mut() {
                Some(line) if self.width(line) + self.width(&word) + self.letter() <= width => {
                    line.push(' ');
                    line.push_str(&word);
                }
                _ => lines.push(word),
            }
        }
        lines
    }

    /// The text, shortened in its middle to this width.
    fn shortened(self, text: &str, width: usize) -> String {
        let (letters, room): (Vec<char>, _) = (text.chars().collect(), width / self.letter());
        if letters.len() <= room {
            return text.to_owned();
        }
        let half = room.saturating_sub(2) / 2;
        letters[..half].iter().chain(&['.', '.']).chain(&letters[letters.len() - half..]).collect()
    }
}

/// Pixels, row by row.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Pixels {
    pub(super) size: [usize; 2],
    pixels: Vec<Rgb>,
}

impl Pixels {
    /// A white sheet.
    pub(super) fn white(size: [usize; 2]) -> Self {
        Self { size, pixels: vec![[255; 3]; size[0] * size[1]] }
    }

    pub(super) fn of(size: [usize; 2], pixels: Vec<Rgb>) -> Self {
        Self { size, pixels }
    }

    /// Sets the pixels of another sheet at a corner.
    pub(super) fn put(&mut self, other: &Self, [left, top]: [usize; 2]) {
        for (row, line) in other.pixels.chunks_exact(other.size[0].max(1)).enumerate() {
            for (column, &colour) in line.iter().enumerate() {
                self.set([left + column, top + row], colour);
            }
        }
    }

    pub(super) fn set(&mut self, [column, row]: [usize; 2], colour: Rgb) {
        if column < self.size[0] && row < self.size[1] {
            self.pixels[row * self.size[0] + column] = colour;
        }
    }

    /// Writes a line of text with its upper left corner there. A character that the font lacks becomes a question mark.
    pub(super) fn write(&mut self, text: &str, [left, top]: [usize; 2], size: Size) {
        for (i, letter) in text.chars().map(in_font).enumerate() {
            let raster = |letter| get_raster(letter, FontWeight::Regular, size.raster());
            let Some(raster) = raster(letter).or_else(|| raster('?')) else { continue };
            for (row, line) in raster.rows().enumerate() {
                for (column, &share) in line.iter().enumerate().filter(|(_, share)| **share > 0) {
                    let ink = INK.map(|c| (255 - (255 - u32::from(c)) * u32::from(share) / 255) as u8);
                    self.set([left + i * size.letter() + column, top + row], ink);
                }
            }
        }
    }

    /// The picture as PNG.
    pub(super) fn png(&self) -> io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        let [width, height] = self.size.map(|n| n as u32);
        let mut encoder = png::Encoder::new(&mut bytes, width, height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_compression(png::Compression::High);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(self.pixels.as_flattened())?;
        writer.finish()?;
        Ok(bytes)
    }
}

/// The nearest character that the font has.
fn in_font(letter: char) -> char {
    match letter {
        '–' | '—' | '−' => '-',
        '≥' => '>',
        '…' => '.',
        '∞' => '~',
        'μ' => 'µ',
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_is_as_wide_as_its_letters_and_is_broken_at_spaces() {
        let mut sheet = Pixels::white([200, 40]);
        sheet.write("|µm²–|", [10, 4], Size::Caption);
        let dark = |column: usize| (0..40).any(|row| sheet.pixels[row * 200 + column][0] < 128);
        let width = Size::Caption.width("|µm²–|");
        assert!((10..10 + width).any(dark) && !(0..10).any(dark) && !(10 + width..200).any(dark));
        let lines = Size::Tick.wrapped("a very long name of a-table-with-hyphens", Size::Tick.width("123456789012"));
        assert_eq!(lines, ["a very long", "name of", "a-tab..phens"]);
        assert!(Size::Tick.wrapped("", 100).is_empty());
    }

    #[test]
    fn a_png_reads_back() {
        let mut sheet = Pixels::white([3, 2]);
        sheet.set([1, 1], [1, 2, 3]);
        let bytes = sheet.png().unwrap();
        let mut reader = png::Decoder::new(io::Cursor::new(bytes)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut pixels).unwrap();
        assert_eq!(pixels, sheet.pixels.as_flattened());
    }
}
