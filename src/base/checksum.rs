//! Values serialised with a checksum: a tag, the value in postcard's format, and the BLAKE3 hash of both.
//!
//! Bytes with another tag or a wrong hash (foreign, truncated or damaged) decode as `None`. They are cached results, so the
//! caller computes the value again.

use std::path::Path;

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::base::atomic_file::{AtomicFile, folder_of};
use crate::base::files::regular;

/// First bytes of a serialised value: the type and the version of its format.
pub(crate) type Tag = [u8; 8];

/// Serialises `value` with its checksum.
pub(crate) fn encode(tag: &Tag, value: &impl Serialize) -> std::io::Result<Vec<u8>> {
    let mut bytes = postcard::to_extend(value, tag.to_vec()).map_err(std::io::Error::other)?;
    let hash = blake3::hash(&bytes);
    bytes.extend(hash.as_bytes());
    Ok(bytes)
}

/// Writes `value` with its checksum to `path`; a missing folder is created. A pipe in its place is an error.
pub(crate) fn write(path: &Path, tag: &Tag, value: &impl Serialize) -> std::io::Result<()> {
    std::fs::create_dir_all(folder_of(path))?;
    if let Ok(found) = std::fs::metadata(path) {
        regular(&found)?;
    }
    AtomicFile::write(path, encode(tag, value)?)
}

/// The hash of `value`, used as a file name or key.
pub(crate) fn hash(tag: &Tag, value: &impl Serialize) -> blake3::Hash {
    // Plain data of known length is serialised to memory, which cannot fail.
    let bytes = postcard::to_extend(value, tag.to_vec()).unwrap_or_else(|e| unreachable!("{e}"));
    blake3::hash(&bytes)
}

/// The value, if tag and hash match.
pub(crate) fn decode<T: DeserializeOwned>(tag: &Tag, bytes: &[u8]) -> Option<T> {
    let (content, hash) = bytes.split_last_chunk::<{ blake3::OUT_LEN }>()?;
    let value = content.strip_prefix(tag).filter(|_| blake3::hash(content).as_bytes() == hash)?;
    postcard::from_bytes(value).ok()
}

/// The first field of a value, read from the first bytes alone; the hash is not verified.
pub(crate) fn first_field<T: DeserializeOwned>(tag: &Tag, head: &[u8]) -> Option<T> {
    Some(postcard::take_from_bytes(head.strip_prefix(tag)?).ok()?.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Deserialize;

    #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
    struct Value {
        name: String,
        numbers: Vec<f64>,
        places: Vec<glam::DVec3>,
    }

    const TAG: &Tag = b"PWTEST01";

    #[test]
    fn values_round_trip_bit_for_bit_and_damaged_bytes_decode_as_none() {
        let value = Value {
            name: "scene".to_owned(),
            numbers: vec![0.1, f64::INFINITY, -0.0],
            places: vec![glam::DVec3::new(0.5, -0.25, 1.0 / 3.0)],
        };
        let bytes = encode(TAG, &value).unwrap();
        let decoded: Value = decode(TAG, &bytes).unwrap();
        assert_eq!(decoded, value);
        assert!(decoded.numbers[2].is_sign_negative());
        assert_eq!(hash(TAG, &value.places), hash(TAG, &[[0.5, -0.25, 1.0 / 3.0]].to_vec()), "points are triples");
        assert_eq!(first_field::<String>(TAG, &bytes[..20]).unwrap(), "scene");
        assert!(decode::<Value>(b"PWTEST02", &bytes).is_none());
        for length in 0..bytes.len() {
            assert!(decode::<Value>(TAG, &bytes[..length]).is_none(), "the first {length} bytes");
        }
        for i in 0..bytes.len() {
            let mut flipped = bytes.clone();
            flipped[i] ^= 1;
            assert!(decode::<Value>(TAG, &flipped).is_none(), "byte {i} flipped");
        }
    }
}
