//! What becomes of PARTs from one range table to another.

use crate::parts::{Parts, UNASSIGNED};

/// PARTs of one table seen from another's.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize)]
pub(crate) struct Changes {
    /// PARTs of the first table that have the same vertices in the second.
    pub(crate) kept: usize,
    /// PARTs of the first table whose vertices fall into several of the second.
    pub(crate) split: usize,
    /// PARTs of the second table that take vertices from several of the first.
    pub(crate) merged: usize,
}

impl Changes {
    /// From one cut of a garment to another. Vertices in no PART count as one more PART where others go to it or come from it.
    pub(crate) fn between(from: &Parts, to: &Parts) -> Self {
        let pairs = from.part_of_vertex.iter().zip(&to.part_of_vertex);
        let mut meet: Vec<(u32, u32)> = pairs.map(|(&a, &b)| (a, b)).collect();
        meet.sort_unstable();
        meet.dedup();
        let mut back: Vec<(u32, u32)> = meet.iter().map(|&(a, b)| (b, a)).collect();
        back.sort_unstable();
        let runs = |pairs: &[(u32, u32)]| pairs.chunk_by(|p, q| p.0 == q.0).filter(|run| run.len() > 1).count();
        let alone = |pairs: &[(u32, u32)], key: u32| {
            let first = pairs.partition_point(|p| p.0 < key);
            pairs.get(first + 1).is_none_or(|p| p.0 != key)
        };
        let kept = meet.iter().filter(|&&(a, b)| a != UNASSIGNED && alone(&meet, a) && alone(&back, b)).count();
        Self { kept, split: runs(&meet), merged: runs(&back) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::DVec3;
    use crate::mesh::{Topology, TriMesh};
    use crate::parts::range_table::RangeTable;
    use crate::parts::segment;

    /// A strip of vertices at 0, 1, 2, ... cm from the body.
    fn cut(bounds_cm: &[f64]) -> Parts {
        cut_by(&RangeTable::from_inner_bounds("t", bounds_cm).unwrap())
    }

    fn cut_by(table: &RangeTable) -> Parts {
        let n = 12_u32;
        let positions = (0..n).map(|i| DVec3::new(f64::from(i / 2), f64::from(i % 2), 0.0)).collect();
        let triangles = (0..n - 2).map(|i| [i, i + 1, i + 2]).collect();
        let topology = Topology::new(&TriMesh::new(positions, triangles));
        let distance: Vec<f64> = (0..n).map(|i| 0.01 * f64::from(i / 2) + 0.001).collect();
        segment(&topology, &distance, table)
    }

    #[test]
    fn split_merged_and_kept_by_hand() {
        let (coarse, fine) = (cut(&[2.0, 4.0]), cut(&[2.0, 3.0, 4.0]));
        assert_eq!(Changes::between(&coarse, &fine), Changes { kept: 2, split: 1, merged: 0 });
        assert_eq!(Changes::between(&fine, &coarse), Changes { kept: 2, split: 0, merged: 1 });
        assert_eq!(Changes::between(&fine, &fine), Changes { kept: 4, split: 0, merged: 0 });
        // A bound that moves splits one and merges into its neighbour.
        assert_eq!(Changes::between(&cut(&[2.0]), &cut(&[3.0])), Changes { kept: 0, split: 1, merged: 1 });
        // Vertices in no PART are none that is kept.
        let none = cut_by(&RangeTable::from_bounds("none", &[50.0, 60.0]).unwrap());
        assert_eq!(Changes::between(&none, &none), Changes::default());
    }
}
