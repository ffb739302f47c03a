//! Why a garment has no energy.

/// Why a garment has no energy. The user can correct each of these.
#[derive(Debug, thiserror::Error)]
pub enum EnergyError {
    /// The rest shape belongs to another mesh.
    #[error("the rest shape has {rest} triangles and the garment {mesh}: give the rest shape of this very mesh")]
    RestCount {
        /// Triangles of the rest shape.
        rest: usize,
        /// Triangles of the mesh.
        mesh: usize,
    },
    /// A triangle without rest area has no strain.
    #[error("triangle number {} has no area in the rest shape: repair the mesh or the pattern first", .triangle + 1)]
    Degenerate {
        /// Its index, from 0.
        triangle: usize,
    },
    /// Triangles are cut from a fabric that is missing.
    #[error("the garment is cut from {cut_from} fabrics and {given} given: give each, in the order of their numbers")]
    Fabrics {
        /// Fabrics that the rest shape names.
        cut_from: usize,
        /// Fabrics in the list.
        given: usize,
    },
    /// A held vertex that does not exist.
    #[error("held vertex number {} does not exist: the garment has {count}", u64::from(*.vertex) + 1)]
    Held {
        /// The index, from 0.
        vertex: u32,
        /// Number of vertices.
        count: usize,
    },
    /// No vertex is free to move.
    #[error(
        "no vertex is free: all {count} are held, expected at least one that is not; hold an edge alone (--hold top)"
    )]
    NothingFree {
        /// Number of vertices.
        count: usize,
    },
}
