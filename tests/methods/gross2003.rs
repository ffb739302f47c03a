//! Pieces on developable surfaces: the surfaces enclose the body, laid pieces keep their lengths, sewn garments converge.

use std::path::Path;

use partwise::garment::fabric::Fabric;
use partwise::mechanics::energy::Cloth;
use partwise::mechanics::methods::gross2003::Gross2003;
use partwise::mechanics::methods::gross2003::cut::cut;
use partwise::mechanics::methods::gross2003::developable::Developable;
use partwise::mechanics::methods::gross2003::pieces::{BodyPart, Piece, distortion, lay_all, of_pattern, parts};
use partwise::mechanics::methods::{Ended, Exhibit, MethodError, MethodInput, RestRule};
use partwise::{DVec3, Scene, SceneSpec};

use super::scenes::{drape, hanging, rectangle};

const CLEARANCE: f64 = 0.008;

fn dressed(garment: &str) -> Scene {
    SceneSpec::new("form", garment).load().unwrap().scene
}

/// Pieces, the body's parts, and the surfaces around them.
fn prepared(scene: &Scene, pieces: Option<Vec<Piece>>) -> (Vec<Piece>, Vec<BodyPart>, Vec<Developable>) {
    let fabric = Fabric::default();
    let cloth = Cloth::new(&scene.garment, &scene.topology, &scene.rest, &fabric, &scene.held).unwrap();
    let dressing = MethodInput { scene, fabric: &fabric, cloth: &cloth };
    let pieces = pieces.unwrap_or_else(|| cut(&dressing).unwrap());
    let parts = parts(&dressing, &pieces).unwrap();
    let around = |part: &BodyPart| {
        let vertices = part.pieces.iter().flat_map(|&p| &pieces[p].vertices);
        let worn: Vec<DVec3> = vertices.map(|&v| scene.garment.positions[v as usize]).collect();
        Developable::around(&part.points, part.axis, &worn, CLEARANCE).unwrap()
    };
    let surfaces = parts.iter().map(around).collect();
    (pieces, parts, surfaces)
}

#[test]
fn a_pullover_is_cut_into_front_back_and_two_halves_of_each_sleeve() {
    let scene = dressed("pullover-1@1500");
    let (pieces, parts, _) = prepared(&scene, None);
    assert_eq!(pieces.len(), 6, "{:?}", pieces.iter().map(|p| &p.name).collect::<Vec<_>>());
    // Trunk and two arms, whose axes mirror each other but for where the body's units end, which is a band's matter.
    assert_eq!(parts.len(), 3);
    let mut arms: Vec<DVec3> = parts.iter().map(|p| p.axis).filter(|axis| axis.x.abs() > 0.1).collect();
    arms.sort_by(|a, b| a.x.total_cmp(&b.x));
    assert!((arms[0] * DVec3::new(-1.0, 1.0, 1.0)).distance(arms[1]) < 0.1, "{arms:?}");
    // Every triangle is in one piece.
    let mut triangles: Vec<u32> = pieces.iter().flat_map(|p| p.of_garment.clone()).collect();
    triangles.sort_unstable();
    assert_eq!(triangles, (0..scene.garment.triangles.len() as u32).collect::<Vec<_>>());
    for piece in &pieces {
        for (own, &t) in piece.triangles.iter().zip(&piece.of_garment) {
            assert_eq!(own.map(|v| piece.vertices[v as usize]), scene.garment.triangles[t as usize]);
        }
    }
    // A bodice over a bust has no exact pattern, but nearly one.
    let [p95, most] = distortion(&pieces, &scene.rest);
    assert!(p95 < 0.06 && most < 0.3, "{p95} {most}");
}

#[test]
fn bounding_surfaces_bound_the_body_and_pieces_lie_on_them_at_their_own_lengths() {
    for garment in ["pullover-1@1500", "flared-skirt@900", "low-cut-dress@1500"] {
        let scene = dressed(garment);
        let (pieces, parts, surfaces) = prepared(&scene, None);
        for (part, surface) in parts.iter().zip(&surfaces) {
            assert!(part.points.len() > 100);
            let nearest = part.points.iter().map(|p| surface.outside(*p)).fold(f64::NEG_INFINITY, f64::max);
            assert!(nearest <= -CLEARANCE * 0.999, "{garment}: {nearest}");
        }
        let laid = lay_all(&pieces, &parts, &surfaces, &scene.garment.positions);
        for (number, (piece, x)) in pieces.iter().zip(&laid).enumerate() {
            let of = parts.iter().position(|p| p.pieces.contains(&number)).unwrap();
            assert!(x.iter().all(|x| surfaces[of].outside(*x).abs() < 1e-9));
            let (mut worst, mut sum, mut count) = (0.0_f64, 0.0, 0.0);
            for t in &piece.triangles {
                for k in 0..3 {
                    let (a, b) = (t[k] as usize, t[(k + 1) % 3] as usize);
                    let share = x[a].distance(x[b]) / piece.flat[a].distance(piece.flat[b]);
                    // A chord over an edge between two facets is shorter than the way, and never longer.
                    assert!(share < 1.0 + 1e-9, "{garment}: {share}");
                    worst = worst.max(1.0 - share);
                    (sum, count) = (sum + 1.0 - share, count + 1.0);
                }
            }
            // Edges of 3 cm on an arm of 5 cm: a chord misses (e/r)²/24 of its arc, 1.5 %.
            assert!(sum / count < 1e-2, "{garment}: {}", sum / count);
            assert!(worst < 0.2, "{garment}: {worst}");
        }
    }
}

#[test]
fn a_skirt_is_sewn_and_comes_to_rest_outside_the_body_with_the_same_bits_every_time() {
    let scene = dressed("flared-skirt@600");
    let method = Gross2003 { exhibit: true, ..Gross2003::default() };
    let made = drape(&method, &scene, &Fabric::default(), &RestRule::default()).unwrap();
    assert_eq!(made.ended, Ended::AtRest);
    let nearest = scene.body.nearest_all(&made.positions);
    assert!(nearest.iter().all(|near| near.signed_distance > 0.0));
    // Held where it is worn, and hanging from there.
    assert!(scene.held.iter().all(|&v| made.positions[v as usize] == scene.garment.positions[v as usize]));
    let again = drape(&method, &scene, &Fabric::default(), &RestRule::default()).unwrap();
    assert_eq!(made.positions, again.positions);
    let [("bounding surfaces", Exhibit::Lines(lines)), ("pieces", Exhibit::Moving { mesh, frames })] =
        made.exhibits.as_slice()
    else {
        panic!()
    };
    assert!(!lines.is_empty() && frames.len() > 5);
    assert!(frames.iter().all(|(_, x)| x.len() == mesh.vertex_count()));
    assert!(mesh.vertex_count() > scene.garment.vertex_count(), "seams are copies");
}

#[test]
fn a_pattern_brings_its_own_panels() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/patterns/tshirt.json");
    let loaded = SceneSpec { edge_cm: 3.0, ..SceneSpec::new("form", file.display().to_string()) }.load().unwrap();
    let sewn = &loaded.tailored.as_ref().unwrap().put_on.garment;
    let pieces = of_pattern(sewn, &loaded.scene.garment).unwrap();
    assert_eq!(pieces.len(), sewn.panels.len());
    // Flat as the file has them: exactly the rest shape.
    let [_, most] = distortion(&pieces, &loaded.scene.rest);
    assert!(most < 1e-9, "{most}");
    let method = Gross2003 { sewn: Some(sewn.clone()), ..Gross2003::default() };
    let made = drape(&method, &loaded.scene, &Fabric::default(), &RestRule::default()).unwrap();
    assert_eq!(made.ended, Ended::AtRest);
    assert!(made.notes.iter().all(|note| !note.contains("open")), "{:?}", made.notes);
    let seams = made.counts.iter().find(|c| c.0 == "seam pairs").unwrap().1;
    assert!(seams > 20, "{seams}");
}

#[test]
fn cloth_without_seams_is_refused_in_one_line() {
    let scene = hanging(rectangle(DVec3::X, DVec3::Y, 4, 4), vec![0]);
    let error = drape(&Gross2003::default(), &scene, &Fabric::default(), &RestRule::default()).unwrap_err();
    assert!(matches!(error, MethodError::Unfit { .. }));
    assert!(error.to_string().contains("no seams") && !error.to_string().contains('\n'), "{error}");
}
