//! Options of the solver: every tolerance, limit and switch of Newton's method at full resolution, with its default.
//!
//! One group for each mechanism, in the order in which a solve meets them. `partwise bench ablation` changes one option at a time
//! (`docs/guide/solver.md`). Numbers of steps without a comparison are those of its 21 small drapes together (the columns "before", 545 with the
//! defaults); an eighth more or less is chance. Options are set by `--solver GROUP.KEY=VALUE`, in a job (`[settings.solver.GROUP]`) and in
//! a sweep; they are for experiments, and what was measured was measured with the defaults.
//!
//! Constants that describe the model (stiffness of contact, thickness, friction) or the machine (sizes of chunks) are not here.

mod by_name;

use serde::{Deserialize, Serialize};

pub use by_name::SolverOptionError;

macro_rules! options {
    ($($(#[$group_doc:meta])* $group:ident { $($(#[$doc:meta])* $key:ident: $type:ty = $default:expr,)* })*) => {
        $(
            $(#[$group_doc])*
            #[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
            #[serde(default, deny_unknown_fields)]
            pub struct $group { $($(#[$doc])* pub $key: $type,)* }

            impl Default for $group {
                fn default() -> Self {
                    Self { $($key: $default,)* }
                }
            }
        )*
    };
}

options! {
    /// Nested iteration: a large garment rests on coarser cloth first.
    NestedIterationOptions {
        /// Vertices that a coarser garment must have to be brought to rest first. Without and with, processor time: two garments of 16,000
        /// vertices 54 and 23 s in knit (25 and 6 steps), 189 and 111 s in cotton; four of 6,463 to 10,861 12 and 14 s, and 44 and 43 s; a
        /// jumpsuit sewn from its pattern 32 and 7 s, and 62 and 70 s.
        min_vertices: usize = 1500,
        /// Most steps on a coarser garment. A stiff one takes over a hundred to its rest, of which the first bring it into the right
        /// folds. With 80, five stiff garments of 16,000 take 239 steps at full resolution for 213.
        max_steps: usize = 20,
    }

    /// Softened continuation: stiff cloth far from rest is settled with a capped stiffness first.
    SofteningOptions {
        /// Strain under its own hanging weight at which the stiffness is capped; 0 for the true stiffness throughout: 604 steps.
        strain: f64 = 0.005,
        /// Residual, over ‖m g‖₂ (that of cloth in free fall), above which cloth is softened. A drape that was at rest before is well below.
        min_residual: f64 = 0.5,
        /// Residual over weight at which the softened cloth gets its true stiffness. Halved, doubled: 550, 563 steps.
        tolerance: f64 = 1e-2,
    }

    /// Newton's method: damping and line search.
    NewtonOptions {
        /// Residual over weight that counts as converged.
        tolerance: f64 = 1e-3,
        /// No run takes more steps.
        max_steps: usize = 2000,
        /// Steps without progress after which a solve has stalled. Contact places with which the cloth does not rest are removed after 80.
        stall_steps: usize = 100,
        /// Longest move of a vertex in one step, m.
        longest_move_m: f64 = 0.1,
        /// Damping ε to begin with, in g/L ([`refine`](super::refine)). Evidence: decision 33.
        damping: f64 = 8.0,
        /// Least damping, and that to begin with from a drape that rested, in g/L. Halved, doubled: 538, 530 steps.
        min_damping: f64 = 0.1,
        /// Factor on the damping after a short step; after a whole one it is divided by it.
        damping_factor: f64 = 2.0,
        /// Share of its length below which a step is short. With 0.1 a knotted ribbon does not rest, with 1e-5 two of 288 families did not
        /// (28 November 2026).
        short_step: f64 = 0.3,
        /// Largest extrapolation of a step: see `newton::extrapolation`. With 2 ten garments of 1,000 to 5,500 vertices take 93 steps in knit and
        /// 248 in cotton, with 1 95 and 279.
        max_extrapolation: f64 = 2.0,
        /// Cosine with the previous step above which a step continues it. With 0.4, and without: 547, 591 steps.
        continues_cosine: f64 = 0.8,
    }

    /// Relaxation of steps by L-BFGS: see `newton::relax`.
    RelaxationOptions {
        /// Iterations at the start and after a step. With 0: 677 steps.
        iterations: usize = 20,
        /// Iterations for a trial that failed: it has further to go, and a step cut short costs another factorisation. Ten garments of 1,000 to
        /// 5,500 vertices take 109 steps in knit and 326 in cotton with 60, 94 and 229 with 120 (and fewer projected steps), in less time; with 160 some fewer, in
        /// as much.
        trial_iterations: usize = 120,
        /// Most trials of a line search that are relaxed. With trials of whole steps alone two ponchos of two layers and 60 vertices do not rest.
        max_trials: usize = 2,
        /// Longest move of a vertex in one iteration, m: a fraction of a triangle.
        longest_move_m: f64 = 3e-3,
    }

    /// The check of a rest: see `newton::saddle_escape`.
    RestCheckOptions {
        /// Most checks; 0 for none. Without them the five garments at ten sizes in two fabrics take 327 steps for 354, and four of them end at saddle
        /// points or still move; with four checks one still does, and from other previews with eight. With 16 two tubes of two layers end at a saddle point.
        max_checks: usize = 32,
        /// Shortest move of a vertex along an unstable direction, m: a wrinkle buckles by tenths of a millimetre. The longest is that of a step.
        shortest_escape_m: f64 = 2e-5,
    }

    /// Damping of cycles: see [`refine`](super::refine).
    CycleOptions {
        /// Ratio to the least residual so far below which a residual is progress, which ends a cycle. With 1 three of 72
        /// garments of two layers (60 to 1,000 vertices) do not rest.
        progress_ratio: f64 = 0.9,
        /// Residual over weight above which steps do not count as a cycle; 0 turns the damping of cycles off. With 0 three of 192 coarse
        /// garments do not rest; with 0.1 one of a hundred perturbed starts stays in a cycle at 0.12.
        max_residual: f64 = 0.3,
        /// Steps without progress that may count as a cycle. Halved, doubled: 556, 545 steps.
        window: usize = 12,
        /// They do if the energy changed by less than this share of what it went up and down. Without this condition one of 68 drapes does not rest.
        return_share: f64 = 0.3,
        /// Least share of a step that is taken. With 1 one of 192 coarse garments (60 and 250 vertices) stalls, which one depends on other options.
        min_step_share: f64 = 0.125,
        /// Least under-relaxation of gaps. With 1 two of 192 garments of 60 and 250 vertices do not rest.
        min_under_relaxation: f64 = 1.0 / 64.0,
    }

    /// Contact of vertices with the body: see `energy::contact`.
    BodyContactOptions {
        /// Factor on the stiffness κ where a vertex is pressed into the body. With 1 a jumpsuit stalls with a vertex inside.
        stiffening: f64 = 4.0,
        /// Most times that the cloth is moved off protrusions of the body. With 0 a jumpsuit takes 93 steps for 16, with skin through cloth.
        max_protrusion_fixes: usize = 3,
    }

    /// Contact places within triangles: see `energy::face_contacts`.
    FaceContactOptions {
        /// Residual over weight below which places are added before the cloth rests with the present ones. With 0: 593 steps.
        max_residual: f64 = 0.1,
        /// Steps after which the places are removed if the cloth does not rest with them. The most observed are 24, in a pair of trousers.
        max_steps: usize = 80,
        /// Amount by which the offset of a place is raised at a time, m. Halved or doubled: the same steps.
        offset_step_m: f64 = 3e-4,
        /// Largest total amount by which the offset of a place is raised, m. With 0 skin goes through cloth in one of 33 drapes more.
        max_offset_raise_m: f64 = 4e-3,
        /// Least offset of a place, m: the amount by which the body rises between two places of a lattice.
        min_offset_m: f64 = 6e-4,
        /// Updates without fewer intersections after which the intersecting triangles are released. Without it two patterns that are strained
        /// by over 100 % end after 365 and 585 steps for 214 and 156. With 3 a sheet over a cube ends with skin through cloth in five pairs.
        max_idle_updates: usize = 4,
    }

    /// Contact of the cloth with itself: see `energy::proximity`.
    SelfContactOptions {
        /// Distance up to which gaps are searched, in offsets: large enough that a step closes no gap which the search missed. Halved,
        /// doubled: 552, 526 steps.
        search_reach: f64 = 2.5,
        /// Least offset in mean edges, so that contact is distinguished from intersection. Halved, doubled: 544, 550 steps.
        min_offset_of_edge: f64 = 0.1,
        /// Largest value of that least offset on a coarse mesh, m. Without it three of 48 garments of two layers (60 and 250
        /// vertices) do not rest.
        max_min_offset_m: f64 = 4e-3,
        /// Largest offset in mean edges: places two triangles apart on a flat cloth must not form a gap.
        max_offset_of_edge: f64 = 0.25,
        /// Share of their distance as placed below which topological neighbours press. With 0 a shirt in cotton takes 106 steps for 63.
        neighbour_share: f64 = 0.5,
        /// Share of its rest area that an edge contributes to a gap: a vertex has some three edges, each with several gaps.
        edge_area_share: f64 = 0.25,
        /// A gap with less than this share of its offset left grows stiffer. Halved, doubled: 536, 588 steps.
        narrow_share: f64 = 0.25,
        /// Factor by which a narrow gap grows stiffer at a refresh. With 1, two of eight trousers of 250 vertices do not rest.
        stiffening: f64 = 2.0,
        /// Largest ratio of the stiffness of a gap to its initial one. With 64 a pair of shorts and a shirt, cut to the body in cotton, do not
        /// rest; with 1024 one of 288 families ends with a vertex inside.
        max_stiffening: f64 = 256.0,
        /// Margin of the list of near triangles in mean edges. A larger one is rebuilt less often and gives a longer list. Halved or
        /// doubled: the same steps.
        list_margin_of_edge: f64 = 0.5,
    }

    /// The collision filter: which steps are taken, cut or rejected.
    CollisionFilterOptions {
        /// Spacing of the checks along a step, in mean edges: cloth is at least an edge wide. With 2, a step of 8 cm carried a ring of cloth three
        /// edges wide through another unseen.
        check_spacing: f64 = 1.0,
        /// Longest move of a step that is taken with parts held back even if its energy rises, in mean edges; a longer one must lower it. With 0
        /// garments rest as soon, but two sheets that start intersecting stall.
        max_cut_move: f64 = 1.0,
        /// Times that intersecting corners go back half the way; after that they go all the way, with their neighbours. With 0: 626 steps,
        /// and one drape does not rest.
        max_halvings: usize = 4,
        /// Most times that a step is cut. Each cut holds back one more ring of neighbours; without a limit a hundred perturbed starts were
        /// not done after 26 minutes beside other jobs, for three on an idle machine. Halved or doubled: the same steps.
        max_cuts: usize = 16,
        /// Rings of neighbours about intersecting triangles in which new intersections are allowed. With 0 a shirt sewn from its pattern
        /// stops after 654 steps with 44 crossing pairs (14 steps with 2).
        tangled_rings: usize = 2,
    }
}

/// All options of the solver.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SolverOptions {
    /// Nested iteration on coarser cloth.
    pub nested_iteration: NestedIterationOptions,
    /// Softened continuation.
    pub softening: SofteningOptions,
    /// Newton's method.
    pub newton: NewtonOptions,
    /// Relaxation of steps.
    pub relaxation: RelaxationOptions,
    /// The check of a rest.
    pub rest_check: RestCheckOptions,
    /// Damping of cycles.
    pub cycles: CycleOptions,
    /// Contact of vertices with the body.
    pub body_contact: BodyContactOptions,
    /// Contact places within triangles.
    pub face_contact: FaceContactOptions,
    /// Contact of the cloth with itself.
    pub self_contact: SelfContactOptions,
    /// The collision filter.
    pub collision_filter: CollisionFilterOptions,
}
