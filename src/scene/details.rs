//! Details of a garment: buttons, buckles and clasps that are connected parts of their own.
//!
//! A mesh does not tell that a detail is sewn on. Loose, it falls off the body, which ends the drape, and on its way its weight keeps the
//! residual above the tolerance. Details are therefore held where they were placed; self-contact keeps the cloth clear of them.
//!
//! Limit: the cloth below a detail moves away from it by as much as it sinks.

use std::collections::BTreeSet;

use super::Scene;

/// A connected part with less than this share of the area of the garment's largest part is a detail. Buttons, buckles and clasps of
/// MakeHuman's suits have up to 0.3 %, the next larger loose parts 7 % and more. A heuristic.
const MAX_DETAIL_SHARE: f64 = 0.01;

impl Scene {
    /// Holds the details of which nothing is held; returns a note about them.
    pub(super) fn hold_details(&mut self) -> Option<String> {
        let (part_of, count) = self.topology.components();
        let mut areas = vec![0.0; count];
        for (corners, area) in self.garment.triangles.iter().zip(self.rest.areas()) {
            areas[part_of[corners[0] as usize] as usize] += area.abs();
        }
        let largest = areas.iter().copied().fold(0.0, f64::max);
        let is_detail = |part: &usize| areas[part - 1] < MAX_DETAIL_SHARE * largest;
        let details: BTreeSet<usize> = self.loose_parts().into_iter().filter(is_detail).collect();
        if details.is_empty() {
            return None;
        }
        let of_details = |v: &u32| details.contains(&(part_of[*v as usize] as usize + 1));
        self.held.extend((0..self.garment.vertex_count() as u32).filter(of_details));
        self.held.sort_unstable();
        let numbers: Vec<usize> = details.into_iter().collect();
        let [each, are] = if numbers.len() == 1 { ["", "is"] } else { ["each ", "are"] };
        Some(format!(
            "{} {are} held in place, as buttons are sewn on: {each}less than {} % of the largest part's area, and nothing holds them; join \
             them to the cloth to drape them with it",
            self.named(&numbers),
            1e2 * MAX_DETAIL_SHARE
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SceneSpec;

    /// A skirt, of which nothing is held, and a triangle of this size that is joined to nothing.
    fn skirt_with_button(size_m: f64) -> Scene {
        let Scene { body, mut garment, .. } = SceneSpec::new("form", "flared-skirt@900").load().unwrap().scene;
        let first = garment.vertex_count() as u32;
        let at = garment.positions[0];
        garment.positions.extend(
            [at, at + size_m * glam::DVec3::X, at + size_m * glam::DVec3::Z].map(|x| x + 0.05 * glam::DVec3::Y),
        );
        garment.triangles.push([first, first + 1, first + 2]);
        garment.triangle_group.push(garment.triangle_group[0]);
        let rest = crate::mesh::RestShape::from_edges(&garment).unwrap();
        Scene::new(body, garment, rest)
    }

    #[test]
    fn details_are_held_and_larger_parts_are_not() {
        let mut scene = skirt_with_button(0.02);
        let note = scene.hold_details().unwrap();
        let count = scene.garment.vertex_count() as u32;
        assert_eq!(scene.held, [count - 3, count - 2, count - 1]);
        assert!(note.contains("connected part 2 of the garment's 2 is held"), "{note}");
        assert_eq!(scene.hold_details(), None, "held details are not loose");
        assert_eq!(skirt_with_button(0.4).hold_details(), None, "a large part is no detail");
    }
}
