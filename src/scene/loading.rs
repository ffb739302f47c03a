//! Loading: body and garments that a [`SceneSpec`] names are read or made, placed and layered.

use glam::{DVec2, DVec3};

use super::layering::coincident;
use super::loaded::{Loaded, Tailored, Unplaced};
use super::materials::{Cut, CutError};
use super::placement::{closeness, facing_body};
use super::spec::REST_AUTO;
use super::{Scene, SceneError, SceneSpec};
use crate::base::files::{names_a_file, stem};
use crate::body::distance::{Body, DistanceError};
use crate::garment::MeshCache;
use crate::garment::fabric::Fabric;
use crate::garment::pattern::{self, SewnGarment};
use crate::garment::sewing::{draw_shut, put_on};
use crate::mesh::flat_pattern::FlatPattern;
use crate::mesh::import::{Beside, ImportOptions, Imported, import_body, import_garment};
use crate::mesh::{Frame, Front, RestShape, retain};

impl SceneSpec {
    /// The options of the body's file.
    pub(super) fn body_options(&self) -> ImportOptions {
        ImportOptions {
            group: self.body_group.clone(),
            unit: self.body_unit.or(self.unit),
            up: self.body_up.or(self.up),
            weld: self.weld,
            open_body: self.open_body,
            source: self.in_memory.get(&self.body).cloned(),
        }
    }

    /// The options of the garment's file.
    fn garment_options(&self) -> ImportOptions {
        ImportOptions {
            group: self.garment_group.clone(),
            unit: self.garment_unit.or(self.unit),
            up: self.garment_up.or(self.up),
            weld: self.weld,
            open_body: self.open_body,
            source: self.in_memory.get(&self.garment).cloned(),
        }
    }

    /// Reads or makes body and garments.
    ///
    /// # Errors
    /// [`SceneError`] names the file, its line or the name, and the remedy.
    pub fn load(&self) -> Result<Loaded, SceneError> {
        self.load_with(&MeshCache::default())
    }

    /// [`load`](Self::load) with the built-in form and garments from a cache.
    ///
    /// # Errors
    /// As there.
    pub(crate) fn load_with(&self, meshes: &MeshCache) -> Result<Loaded, SceneError> {
        self.check_names()?;
        // Built-in garments depend on the form's measurements, not on its mesh, so both are made at once.
        let (body, made) = rayon::join(|| self.load_body(meshes), || self.make_garment(meshes));
        let (body, imported_body) = body?;
        let mut unplaced = self.unplaced(&body, imported_body.as_ref(), made)?;
        let mut layers = vec![unplaced.layer(self.layer_name(), (0, 0))];
        for spec in self.layers().skip(1) {
            let outer = spec.unplaced(&body, imported_body.as_ref(), spec.make_garment(meshes))?;
            let (coincident, vertices) = (coincident(&unplaced.mesh, &outer.mesh), outer.mesh.vertex_count());
            // Contact cannot determine which of the two is outside, and the solve takes minutes.
            if 2 * coincident > vertices {
                return Err(SceneError::about(&spec.garment)(SceneError::Coincident { coincident, vertices }));
            }
            let before = (unplaced.mesh.vertex_count(), unplaced.mesh.triangles.len());
            unplaced.add_outer(outer);
            layers.push(unplaced.layer(spec.layer_name(), before));
        }
        let (mut scene, mut pushed_out) = Scene::place(body, unplaced.mesh, unplaced.rest, self.push_out)
            .map_err(SceneError::about(&self.garment))?;
        (scene.layers, scene.distance_to) = (layers, self.distance_to);
        scene.own_fabrics = unplaced.cut.fabrics;
        scene.releases_held = self.hold.is_none() && unplaced.releases_held;
        scene.held = match &self.hold {
            None => unplaced.held,
            Some(edges) => scene.edges(edges).map_err(SceneError::about(&self.garment))?,
        };
        // Built-in garments have no protrusions in them.
        if self.push_out && self.layers().any(|spec| spec.is_a_mesh() || spec.is_a_pattern()) {
            pushed_out.protrusion_move_m = scene.pull_off_protrusions();
        }
        let form = if self.body_is_a_mesh() { None } else { self.form()?.measures().ok() };
        scene.girths_at_m = form.map(|m| [m.bust_height, m.waist_height, m.hip_height]);
        let reports = imported_body.iter().chain(&unplaced.imported).map(|i| i.report.clone()).collect();
        let mut hold_notes = self.hold.as_ref().map(|names| scene.ambiguous_edges(names)).unwrap_or_default();
        hold_notes.extend((!scene.releases_held).then(|| scene.hold_details()).flatten());
        Ok(Loaded {
            scene,
            body_name: stem(&self.body),
            garment_name: self.garment_name(),
            reports,
            pushed_out,
            tailored: unplaced.tailored,
            flat_pattern: unplaced.flat_pattern,
            swatches: unplaced.cut.swatches,
            imported: unplaced.imported,
            hold_notes,
        })
    }

    /// The innermost garment with its fabrics.
    fn unplaced(
        &self,
        body: &Body,
        imported_body: Option<&Imported>,
        made: Option<Result<Unplaced, SceneError>>,
    ) -> Result<Unplaced, SceneError> {
        let mut unplaced = match made {
            Some(made) => made,
            None if self.is_a_pattern() => self.tailor(body, imported_body),
            None => self.load_garment(body, imported_body),
        }?;
        let given = self.fabrics.first().map(|name| Fabric::by_name(name)).transpose().map_err(CutError::from)?;
        let Unplaced { mesh, rest, .. } = &mut unplaced;
        unplaced.cut = Cut::new(&self.layer_name(), given, self.names_of_fabrics(), mesh, rest)?;
        Ok(unplaced)
    }

    pub(super) fn load_body(&self, meshes: &MeshCache) -> Result<(Body, Option<Imported>), SceneError> {
        let new = if self.open_body { Body::new_open } else { Body::new };
        if self.body_is_a_mesh() {
            let imported = import_body(self.body.as_ref(), &self.body_options())?;
            return Ok((new(&imported.mesh)?, Some(imported)));
        }
        let form = meshes.dress_form(&self.form()?).map_err(|source| match names_a_file(&self.body) {
            true => SceneError::in_file(&self.body)(source),
            false => SceneError::Measurements(source),
        })?;
        Ok((new(&form)?, None))
    }

    /// A built-in or described garment; `None` for a mesh or a pattern.
    fn make_garment(&self, meshes: &MeshCache) -> Option<Result<Unplaced, SceneError>> {
        let make = || {
            if self.body_is_a_mesh() {
                return Err(SceneError::NotCutForIt { body: self.body.clone() });
            }
            let (spec, vertices) = self.described()?;
            let made = meshes.garment(&spec, &self.form()?, vertices)?;
            Ok(Unplaced { held: made.held, ..Unplaced::new(made.mesh, made.rest) })
        };
        (!self.is_a_mesh() && !self.is_a_pattern()).then(make)
    }

    /// A garment mesh from a file.
    fn load_garment(&self, body: &Body, imported_body: Option<&Imported>) -> Result<Unplaced, SceneError> {
        let bounds = body.mesh().bounds().ok_or(DistanceError::Empty)?;
        let closeness = |points: &[DVec3]| closeness(body, points);
        let beside = match imported_body {
            Some(body) => Beside::Body { frame: &body.report.frame, bounds, closeness: &closeness },
            None => Beside::Bounds(bounds.0, bounds.1),
        };
        let mut imported = import_garment(self.garment.as_ref(), &self.garment_options(), &beside)?;
        imported.turn_outward(&facing_body(&imported.mesh, body));
        let auto = self.rest == REST_AUTO;
        let flat_pattern = if auto { FlatPattern::find(&imported.mesh, &imported.texture) } else { None };
        let rest = self.imported_rest(&mut imported, flat_pattern)?;
        let held = if self.push_out { draw_shut(&mut imported, &rest, body) } else { Vec::new() };
        let mesh = imported.mesh.clone();
        Ok(Unplaced {
            releases_held: !held.is_empty(),
            held,
            imported: Some(imported),
            flat_pattern,
            ..Unplaced::new(mesh, rest)
        })
    }

    /// A sewing pattern, sewn and put on the body.
    fn tailor(&self, body: &Body, imported_body: Option<&Imported>) -> Result<Unplaced, SceneError> {
        let front = self.front.map(|front| front_of(front, imported_body)).transpose()?;
        let pattern = pattern::read(self.garment.as_ref())?;
        let put_on = put_on(&pattern, body, 0.01 * self.edge_cm, front).map_err(SceneError::about(&self.garment))?;
        let SewnGarment { mesh, rest, .. } = &put_on.garment;
        let (mesh, rest, held) = (mesh.clone(), rest.clone(), put_on.held.clone());
        let tailored = Some(Tailored { pattern, put_on });
        Ok(Unplaced { held, releases_held: true, tailored, ..Unplaced::new(mesh, rest) })
    }

    /// The rest shape of a garment from a file, which loses the triangles that have no area in it.
    fn imported_rest(
        &self,
        imported: &mut Imported,
        flat_pattern: Option<FlatPattern>,
    ) -> Result<RestShape, SceneError> {
        let about = SceneError::about;
        let mut name = self.garment.as_str();
        let of_texture =
            |scale: f64| RestShape::texture_of(&imported.mesh, &imported.texture, scale).map_err(about(&self.garment));
        let mut rest = match (self.rest.as_str(), flat_pattern) {
            (REST_AUTO, Some(pattern)) => of_texture(pattern.metres_per_unit)?,
            (how @ (REST_AUTO | "own"), _) => imported.own_rest(how == REST_AUTO),
            ("texture", _) => of_texture(1.0)?,
            (file, _) => {
                let frame = &imported.report.frame;
                let (unit, up, source) = (Some(frame.unit), Some(frame.up), self.in_memory.get(file).cloned());
                let options = ImportOptions { unit, up, source, ..self.garment_options() };
                let other = import_garment(file.as_ref(), &options, &Beside::File(frame))?;
                let shape = imported.in_the_shape_of(&other)?;
                name = file;
                RestShape::edges_of(&shape)
            }
        };
        let flat = rest.without_area();
        if flat.iter().all(|&flat| flat) {
            return rest.checked().map_err(about(name));
        }
        imported.drop_triangles(&flat);
        retain(&mut rest.corners, |t| !flat[t]);
        retain(&mut rest.guessed, |t| !flat[t]);
        imported.remark_on(&rest);
        Ok(rest)
    }
}

/// The horizontal direction of an axis of the body's file.
fn front_of(front: Front, body: Option<&Imported>) -> Result<DVec2, SceneError> {
    let frame = body.map_or_else(Frame::default, |body| body.report.frame.clone());
    let ahead = frame.to_metres(front.direction()).normalize_or_zero();
    if ahead.z == 0.0 { Ok(ahead.truncate()) } else { Err(SceneError::FrontIsUp { front, up: frame.up }) }
}
