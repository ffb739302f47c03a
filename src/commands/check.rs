//! `partwise check`: the health of a body and a garment, and how they lie about each other, without draping; on request whether the
//! garment, a draped one, is at rest.

use crate::mesh::health::{Health, health};
use crate::scene::Placement;
use crate::study::certificate::{Certificate, CertifyError, certify};
use crate::{Scene, SceneSpec};
use clap::Args;
use serde::Serialize;

use super::run::Format;
use super::{FabricArgs, InputArgs, UserError, certified, console};

/// Arguments of `check`.
#[derive(Debug, Args)]
pub(crate) struct CheckArgs {
    /// Body: `form` or an OBJ file; the same as --body
    #[arg(value_name = "BODY")]
    body_file: Option<String>,
    /// Garment: a name or a file; the same as --garment
    #[arg(value_name = "GARMENT")]
    garment_file: Option<String>,
    #[command(flatten)]
    input: InputArgs,
    /// Certify that this file, the garment after it was draped and exported, is at rest: forces, curvature, contact and strain, from
    /// its positions alone, with rest shape and held edges of the garment as it was given; exit code 1 where a line fails
    #[arg(long, value_name = "DRAPED.obj", help_heading = "Certificate")]
    certificate: Option<String>,
    #[command(flatten, next_help_heading = "Certificate")]
    cloth: FabricArgs,
    /// What to print on stdout
    #[arg(long, value_enum, default_value_t = Format::Text, help_heading = "Output")]
    format: Format,
}

#[derive(Serialize)]
struct Report {
    body: Health,
    garment: Health,
    fit: Placement,
    notes: Vec<String>,
    verdict: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    certificate: Option<Certificate>,
}

/// What of it all is in the way of a drape.
fn verdict(body: &Health, garment: &Health, fit: &Placement) -> String {
    let found = [
        (usize::from(!body.closed), "an open body, whose inside goes by its normals alone"),
        (body.self_intersecting_pairs, "pairs of body triangles that cross"),
        (garment.non_manifold_edges, "garment edges of three triangles or more"),
        (garment.no_area, "garment triangles without area"),
        (
            garment.self_intersecting_pairs,
            "pairs of garment triangles that cross, which a drape takes apart as far as it can",
        ),
        (fit.penetrating_vertices, "garment vertices inside the body, which a drape pushes out first"),
        (fit.crossing_pairs, "pairs of a garment and a body triangle that cross"),
    ];
    let found: Vec<String> =
        found.iter().filter(|(count, _)| *count > 0).map(|(count, what)| format!("{count} {what}")).collect();
    if found.is_empty() {
        "nothing is in the way of a drape".to_owned()
    } else {
        format!("look at {}", found.join("; "))
    }
}

/// Connected parts that are listed, at most.
const LISTED: usize = 12;

/// The connected parts of a garment that has several, by the names that `--hold` takes.
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
    (1..).zip(parts).take(LISTED).map(row).collect()
}

impl CheckArgs {
    pub(crate) fn execute(&self) -> anyhow::Result<()> {
        // As they came: what push-out would mend is a finding here.
        let mut spec = SceneSpec { push_out: false, ..self.cloth.give(self.input.spec()?)? };
        spec.body = self.body_file.clone().unwrap_or(spec.body);
        spec.garment = self.garment_file.clone().unwrap_or(spec.garment);
        let loaded = self.input.load(&spec)?;
        self.cloth.check_used(&loaded)?;
        let scene = &loaded.scene;
        let (body, garment) = (health(scene.body.mesh()), health(&scene.garment));
        let fit = Placement::new(&scene.garment, &scene.body);
        let verdict = verdict(&body, &garment, &fit);
        let certificate = self.certificate.as_ref().map(|draped| self.certify(&spec, scene, draped)).transpose()?;
        let report = Report { body, garment, fit, notes: loaded.notes(), verdict, certificate };
        if self.format == Format::Json {
            console::result(&crate::base::error_text::json(&report)?);
            return certified::verified(report.certificate.as_ref());
        }
        console::notes(&report.notes);
        let mut table = console::table(console::RULED, ["", &loaded.body_name, &loaded.garment_name], []);
        for ((name, body), (_, garment)) in report.body.rows().into_iter().zip(report.garment.rows()) {
            table.add_row([name.to_owned(), body, garment]);
        }
        for (name, value) in connected_parts(scene) {
            table.add_row([name, String::new(), value]);
        }
        for (name, value) in report.fit.rows() {
            table.add_row([name.to_owned(), String::new(), value]);
        }
        console::result(&format!("{table}\nverdict: {}", report.verdict));
        certified::print(report.certificate.as_ref());
        certified::verified(report.certificate.as_ref())
    }

    /// The certificate of a file whose vertices are those of the garment, in their order.
    fn certify(&self, spec: &SceneSpec, scene: &Scene, draped: &str) -> anyhow::Result<Certificate> {
        let spec = SceneSpec {
            garment: draped.to_owned(),
            rest: "own".to_owned(),
            hold: None,
            over: Vec::new(),
            fabrics: Vec::new(),
            fabrics_file: None,
            ..spec.clone()
        };
        let positions = self.input.load(&spec)?.scene.garment.positions;
        certify(scene, &self.cloth.first()?, &positions).map_err(|error| match error {
            CertifyError::Count { .. } | CertifyError::NotFinite { .. } => UserError::new(format!("{draped}: {error}")),
            other => other.into(),
        })
    }
}
