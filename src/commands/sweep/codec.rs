//! Plain data as bytes with a hash at the end: the files a sweep keeps beside its rows.
//!
//! A file is its kind (8 bytes), the data in postcard's format, and the BLAKE3 hash of all before it. What does not match its
//! hash is no file of ours, half of one, or damaged: it reads as nothing.

use std::io;
use std::path::Path;

use partwise::mesh::WholeFile;
use serde::Serialize;
use serde::de::DeserializeOwned;

/// What a file holds and how it begins; the digit goes up with the format.
pub(super) trait Kind: Serialize + DeserializeOwned {
    const KIND: &'static [u8; 8];
}

/// Writes the file whole or not at all.
pub(super) fn write<T: Kind>(path: &Path, value: &T) -> io::Result<()> {
    let bytes = T::KIND.to_vec();
    let mut bytes = postcard::to_extend(value, bytes).map_err(io::Error::other)?;
    bytes.extend(blake3::hash(&bytes).as_bytes());
    WholeFile::write(path, &bytes)
}

/// What the bytes of a file hold.
pub(super) fn read<T: Kind>(bytes: &[u8]) -> Option<T> {
    let (content, hash) = bytes.split_last_chunk::<{ blake3::OUT_LEN }>()?;
    (blake3::hash(content).as_bytes() == hash).then_some(())?;
    postcard::from_bytes(content.strip_prefix(T::KIND)?).ok()
}

/// The first field of what a file begins with, a text, without a look at the hash: for who does not need the rest.
pub(super) fn first_text<T: Kind>(head: &[u8]) -> Option<String> {
    postcard::take_from_bytes(head.strip_prefix(T::KIND)?).ok().map(|(text, _)| text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, PartialEq, Serialize, serde::Deserialize)]
    struct Some(String, Vec<u32>, [f64; 2], Vec<[f32; 3]>);

    impl Kind for Some {
        const KIND: &'static [u8; 8] = b"PWTEST01";
    }

    #[test]
    fn what_is_written_reads_back_and_damage_reads_as_nothing() {
        let folder = tempfile::TempDir::new().unwrap();
        let path = folder.path().join("a.point");
        let value = Some("scene".into(), vec![1, u32::MAX], [0.1, f64::INFINITY], vec![[0.5, -0.25, 2.0]]);
        write(&path, &value).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        assert_eq!(read::<Some>(&bytes).unwrap(), value);
        assert_eq!(first_text::<Some>(&bytes[..20]).unwrap(), "scene");
        assert!(read::<Some>(&bytes[..bytes.len() - 1]).is_none());
        let mut flipped = bytes;
        flipped[20] ^= 1;
        assert!(read::<Some>(&flipped).is_none());
    }
}
