//! Numbers as little-endian bytes with a hash at the end: the files a sweep keeps beside its rows.
//!
//! A file is its kind (8 bytes), lists (a u64 of entries, then the entries), and the BLAKE3 hash of all before it. What does
//! not match its hash is no file of ours, half of one, or damaged: it reads as nothing.

use std::fs;
use std::io;
use std::path::Path;

use glam::DVec3;

/// Bytes in the making.
pub(super) struct Packer(Vec<u8>);

impl Packer {
    pub(super) fn new(kind: &[u8; 8]) -> Self {
        Self(kind.to_vec())
    }

    fn list<const N: usize>(&mut self, entries: impl ExactSizeIterator<Item = [u8; N]>) {
        self.0.extend((entries.len() as u64).to_le_bytes());
        entries.for_each(|bytes| self.0.extend(bytes));
    }

    pub(super) fn text(&mut self, text: &str) {
        self.list(text.bytes().map(|b| [b]));
    }

    pub(super) fn whole(&mut self, numbers: &[u32]) {
        self.list(numbers.iter().map(|n| n.to_le_bytes()));
    }

    pub(super) fn triples(&mut self, triples: &[[u32; 3]]) {
        self.whole(triples.as_flattened());
    }

    /// In double precision: bounds.
    pub(super) fn doubles(&mut self, numbers: &[f64]) {
        self.list(numbers.iter().map(|x| x.to_le_bytes()));
    }

    /// In single precision, which is what a recording holds.
    pub(super) fn singles(&mut self, numbers: &[f64]) {
        self.list(numbers.iter().map(|&x| (x as f32).to_le_bytes()));
    }

    /// In single precision.
    pub(super) fn points(&mut self, points: &[DVec3]) {
        let flat: Vec<f64> = points.iter().flat_map(DVec3::to_array).collect();
        self.singles(&flat);
    }

    /// Writes the file beside its place and renames it, so that nobody sees half of one. Returns its length.
    pub(super) fn write(mut self, path: &Path) -> io::Result<u64> {
        let hash = blake3::hash(&self.0);
        self.0.extend(hash.as_bytes());
        let part = path.with_extension(format!("{}.part", std::process::id()));
        let written = fs::write(&part, &self.0).and_then(|()| fs::rename(&part, path));
        if written.is_err() {
            // On a full disk the half-written file is in everybody's way; if it cannot go, the first error still counts.
            let _ = fs::remove_file(&part);
        }
        written.map(|()| self.0.len() as u64)
    }
}

/// Bytes being read; `None` where they end too early.
pub(super) struct Unpacker<'a>(&'a [u8]);

impl<'a> Unpacker<'a> {
    pub(super) fn new(bytes: &'a [u8], kind: &[u8; 8]) -> Option<Self> {
        let (content, hash) = bytes.split_last_chunk::<{ blake3::OUT_LEN }>()?;
        (blake3::hash(content).as_bytes() == hash).then_some(())?;
        Self::unchecked(content, kind)
    }

    /// Without a look at the hash: for the first entry of a file whose rest is not needed.
    pub(super) fn unchecked(bytes: &'a [u8], kind: &[u8; 8]) -> Option<Self> {
        bytes.strip_prefix(kind).map(Self)
    }

    fn list<const N: usize>(&mut self) -> Option<&'a [[u8; N]]> {
        let (count, rest) = self.0.split_first_chunk::<8>()?;
        let count = usize::try_from(u64::from_le_bytes(*count)).ok()?;
        let (entries, rest) = rest.split_at_checked(count.checked_mul(N)?)?;
        self.0 = rest;
        Some(entries.as_chunks().0)
    }

    pub(super) fn text(&mut self) -> Option<String> {
        String::from_utf8(self.list::<1>()?.as_flattened().to_vec()).ok()
    }

    pub(super) fn whole(&mut self) -> Option<Vec<u32>> {
        Some(self.list()?.iter().map(|b| u32::from_le_bytes(*b)).collect())
    }

    pub(super) fn triples(&mut self) -> Option<Vec<[u32; 3]>> {
        Some(self.whole()?.as_chunks().0.to_vec())
    }

    pub(super) fn doubles(&mut self) -> Option<Vec<f64>> {
        Some(self.list()?.iter().map(|b| f64::from_le_bytes(*b)).collect())
    }

    pub(super) fn singles(&mut self) -> Option<Vec<f64>> {
        Some(self.list()?.iter().map(|b| f64::from(f32::from_le_bytes(*b))).collect())
    }

    pub(super) fn points(&mut self) -> Option<Vec<DVec3>> {
        Some(self.singles()?.as_chunks().0.iter().copied().map(DVec3::from_array).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_reads_back_and_damage_reads_as_nothing() {
        let folder = tempfile::TempDir::new().unwrap();
        let path = folder.path().join("a.point");
        let mut packer = Packer::new(b"PWTEST01");
        packer.text("scene");
        packer.whole(&[1, u32::MAX]);
        packer.doubles(&[0.1, f64::INFINITY]);
        packer.points(&[DVec3::new(0.5, -0.25, 2.0)]);
        packer.write(&path).unwrap();
        let bytes = fs::read(&path).unwrap();
        let mut unpacker = Unpacker::new(&bytes, b"PWTEST01").unwrap();
        assert_eq!(unpacker.text().unwrap(), "scene");
        assert_eq!(unpacker.whole().unwrap(), [1, u32::MAX]);
        assert_eq!(unpacker.doubles().unwrap(), [0.1, f64::INFINITY]);
        assert_eq!(unpacker.points().unwrap(), [DVec3::new(0.5, -0.25, 2.0)]);
        assert!(unpacker.text().is_none());
        let mut torn = bytes.clone();
        torn.truncate(bytes.len() - 1);
        assert!(Unpacker::new(&torn, b"PWTEST01").is_none());
        let mut flipped = bytes;
        flipped[20] ^= 1;
        assert!(Unpacker::new(&flipped, b"PWTEST01").is_none());
    }
}
