//! Values as bytes that are known again: a kind, the value (postcard), and the BLAKE3 hash of both.
//!
//! What does not match its kind or its hash is no value of ours, half of one, or damaged: it opens as nothing, and
//! whoever asked makes it again.

use std::path::Path;

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::base::atomic_file::{WholeFile, folder_of};
use crate::base::files::regular;

/// First bytes of a sealed value: what it is, and the version of its format.
pub(crate) type Kind = [u8; 8];

/// The bytes of `value`.
pub(crate) fn seal(kind: &Kind, value: &impl Serialize) -> std::io::Result<Vec<u8>> {
    let mut bytes = postcard::to_extend(value, kind.to_vec()).map_err(std::io::Error::other)?;
    let hash = blake3::hash(&bytes);
    bytes.extend(hash.as_bytes());
    Ok(bytes)
}

/// Writes `value` sealed as the whole of `path`, whose folder is made if it is not there. A pipe in its place is refused: nobody reads it.
pub(crate) fn write(path: &Path, kind: &Kind, value: &impl Serialize) -> std::io::Result<()> {
    std::fs::create_dir_all(folder_of(path))?;
    if let Ok(found) = std::fs::metadata(path) {
        regular(&found)?;
    }
    WholeFile::write(path, seal(kind, value)?)
}

/// A hash of `value` by its bytes, for use as a name.
#[must_use]
pub(crate) fn hash(kind: &Kind, value: &impl Serialize) -> blake3::Hash {
    // Plain data of known lengths, written to memory: there is nothing that could fail.
    let bytes = postcard::to_extend(value, kind.to_vec()).unwrap_or_else(|e| unreachable!("{e}"));
    blake3::hash(&bytes)
}

/// The value of sealed bytes, if they are whole and of this kind.
#[must_use]
pub(crate) fn open<T: DeserializeOwned>(kind: &Kind, bytes: &[u8]) -> Option<T> {
    let (content, hash) = bytes.split_last_chunk::<{ blake3::OUT_LEN }>()?;
    let value = content.strip_prefix(kind).filter(|_| blake3::hash(content).as_bytes() == hash)?;
    postcard::from_bytes(value).ok()
}

/// The first field of a sealed value, from its first bytes alone and without a look at the hash.
#[must_use]
pub(crate) fn peek<T: DeserializeOwned>(kind: &Kind, head: &[u8]) -> Option<T> {
    Some(postcard::take_from_bytes(head.strip_prefix(kind)?).ok()?.0)
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

    const KIND: &Kind = b"PWTEST01";

    #[test]
    fn what_is_sealed_opens_bit_for_bit_and_damage_opens_as_nothing() {
        let value = Value {
            name: "scene".to_owned(),
            numbers: vec![0.1, f64::INFINITY, -0.0],
            places: vec![glam::DVec3::new(0.5, -0.25, 1.0 / 3.0)],
        };
        let bytes = seal(KIND, &value).unwrap();
        let opened: Value = open(KIND, &bytes).unwrap();
        assert_eq!(opened, value);
        assert!(opened.numbers[2].is_sign_negative());
        assert_eq!(hash(KIND, &value.places), hash(KIND, &[[0.5, -0.25, 1.0 / 3.0]].to_vec()), "points are triples");
        assert_eq!(peek::<String>(KIND, &bytes[..20]).unwrap(), "scene");
        assert!(open::<Value>(b"PWTEST02", &bytes).is_none());
        for length in 0..bytes.len() {
            assert!(open::<Value>(KIND, &bytes[..length]).is_none(), "the first {length} bytes");
        }
        for i in 0..bytes.len() {
            let mut flipped = bytes.clone();
            flipped[i] ^= 1;
            assert!(open::<Value>(KIND, &flipped).is_none(), "byte {i} flipped");
        }
    }
}
