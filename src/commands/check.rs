//! `partwise check`: mesh defects of a body and a garment and the fit of one on the other, without draping; optionally the
//! certificate of a draped garment.

use crate::mesh::health::{Health, health};
use crate::scene::Placement;
use crate::study::certificate::{Certificate, CertifyError, certify};
use crate::{Scene, SceneSpec};
use clap::Args;
use serde_json::json;

use super::console::{self, Format};
use super::inputs::{FabricArgs, InputArgs};
use super::runtime::UserError;
use super::summary::{print_certificate, require_pass};

/// Arguments of `check`.
#[derive(Debug, Args)]
pub(crate) struct CheckArgs {
    /// Body: `form` or a mesh file; the same as --body
    #[arg(value_name = "BODY")]
    body_file: Option<String>,
    /// Garment: a name or a file; the same as --garment
    #[arg(value_name = "GARMENT")]
    garment_file: Option<String>,
    #[command(flatten)]
    input: InputArgs,
    /// Certify that this file, an export of the draped garment, is in equilibrium: forces, curvature, contact and strain are computed
    /// from its positions, with the rest shape and the held edges of the undraped garment; exit code 1 if a criterion fails
    #[arg(long, value_name = "DRAPED.obj|.ply", help_heading = "Certificate")]
    certificate: Option<String>,
    #[command(flatten, next_help_heading = "Certificate")]
    fabric: FabricArgs,
    /// Format of the result on stdout
    #[arg(long, value_enum, default_value_t = Format::Text, help_heading = "Output")]
    format: Format,
}

/// The defects that affect a drape, in one sentence.
fn verdict(body: &Health, garment: &Health, fit: &Placement) -> String {
    let defects = [
        (usize::from(!body.closed), "open body, whose normals alone separate inside from outside"),
        (body.self_intersecting_pairs, "pairs of body triangles that intersect"),
        (garment.non_manifold_edges, "garment edges with three triangles or more"),
        (garment.no_area, "garment triangles without area"),
        (
            garment.self_intersecting_pairs,
            "pairs of garment triangles that intersect; a drape separates them if it can",
        ),
        (fit.penetrating_vertices, "garment vertices inside the body; a drape moves them out first"),
        (fit.crossing_pairs, "pairs of a garment triangle and a body triangle that intersect"),
    ];
    let found = defects.iter().filter(|(count, _)| *count > 0).map(|(count, defect)| format!("{count} {defect}"));
    let found: Vec<String> = found.collect();
    if found.is_empty() { "no defect affects a drape".to_owned() } else { format!("found {}", found.join("; ")) }
}

/// Connected parts listed at most.
const MAX_LISTED: usize = 12;

/// The connected parts of a garment that has several, by the names that `--hold` accepts.
fn connected_parts(scene: &Scene) -> Vec<(String, String)> {
    let (part_of, count) = scene.topology.components();
    if count < 2 {
        return Vec::new();
    }
    let mut parts = vec![(0, f64::INFINITY, f64::NEG_INFINITY); count];
    let floor = scene.body.mesh().bounds().map_or(0.0, |(low, _)| low.z);
    for (&part, p) in part_of.iter().zip(&scene.garment.positions) {
        let (vertices, low, high) = &mut parts[part as usize];
        (*vertices, *low, *high) = (*vertices + 1, low.min(p.z - floor), high.max(p.z - floor));
    }
    let row = |(part, (vertices, low, high))| {
        (format!("  part {part} (--hold top:{part})"), format!("{vertices} vertices, {low:.2} to {high:.2} m high"))
    };
    (1..).zip(parts).take(MAX_LISTED).map(row).collect()
}

impl CheckArgs {
    pub(crate) fn execute(&self) -> anyhow::Result<()> {
        // Without push-out, which would hide penetrating vertices.
        let mut spec = SceneSpec { push_out: false, ..self.fabric.assign(self.input.spec()?)? };
        spec.body = self.body_file.clone().unwrap_or(spec.body);
        spec.garment = self.garment_file.clone().unwrap_or(spec.garment);
        let loaded = self.input.load(&spec)?;
        self.fabric.check_used(&loaded)?;
        let scene = &loaded.scene;
        let (body, garment) = (health(scene.body.mesh()), health(&scene.garment));
        let fit = Placement::new(&scene.garment, &scene.body);
        let verdict = verdict(&body, &garment, &fit);
        let certificate = self.certificate.as_ref().map(|draped| self.certify(&spec, draped)).transpose()?;
        let (certificate, notes) = (certificate.as_ref(), loaded.notes());
        if self.format == Format::Json {
            let mut report =
                json!({ "body": body, "garment": garment, "fit": fit, "notes": notes, "verdict": verdict });
            if let Some(certificate) = certificate {
                report["certificate"] = json!(certificate);
            }
            console::json(&report)?;
            return require_pass(certificate);
        }
        let meshes = body.rows().into_iter().zip(garment.rows());
        let meshes = meshes.map(|((name, body), (_, garment))| [name.to_owned(), body, garment]);
        let fit = fit.rows().into_iter().map(|(name, value)| (name.to_owned(), value));
        let of_garment = connected_parts(scene).into_iter().chain(fit);
        let rows = meshes.chain(of_garment.map(|(name, value)| [name, String::new(), value]));
        let table = console::table(console::RULED, ["", &loaded.body_name, &loaded.garment_name], [], rows);
        console::prose(&format!("{table}\nverdict: {verdict}"));
        print_certificate(certificate);
        console::notes(&notes);
        require_pass(certificate)
    }

    /// The certificate of a file with the faces of the garment in the same order.
    fn certify(&self, spec: &SceneSpec, draped: &str) -> anyhow::Result<Certificate> {
        // Held edges stay where `run` places them.
        let placed = self.input.load(&SceneSpec { push_out: self.input.pushes_out(), ..spec.clone() })?;
        // An export is in the frame of the garment's file.
        let frame = placed.garment_frame();
        let spec = SceneSpec {
            garment: draped.to_owned(),
            garment_unit: frame.map(|frame| frame.unit).or(spec.garment_unit),
            garment_up: frame.map(|frame| frame.up).or(spec.garment_up),
            rest: "own".to_owned(),
            hold: None,
            over: Vec::new(),
            fabrics: Vec::new(),
            fabrics_file: None,
            ..spec.clone()
        };
        let positions = placed.positions_in(&self.input.load(&spec)?)?;
        let mut scene = placed.scene;
        if !scene.held.is_empty() && positions == scene.garment.positions {
            return Err(UserError(format!(
                "{draped}: the held edges cannot be judged: found the positions of the garment itself, expected a drape of it; give \
                 the garment as it was placed before the drape"
            ))
            .into());
        }
        // Held vertices that `run` releases at rest have moved if the garment stays up without them.
        let moved = |&v: &u32| positions[v as usize] != scene.garment.positions[v as usize];
        if scene.releases_held && scene.held.iter().any(moved) {
            scene.held.clear();
        }
        certify(&scene, &self.fabric.first()?, &positions).map_err(|error| match error {
            CertifyError::Count { .. } | CertifyError::NotFinite { .. } => {
                UserError(format!("{draped}: {error}")).into()
            }
            other => other.into(),
        })
    }
}
