//! Where everything lies in a recording: the entity paths, the timelines and the fields.
//!
//! A run with the solver's steps opens on `iteration`; what changes with `table` is there from its first step on.
//!
//! | path | archetype | what | changes with |
//! |---|---|---|---|
//! | `/body` | Mesh3D | the body, as given | mesh file |
//! | `/garment` | Mesh3D | the garment as loaded | mesh file |
//! | `/distance/garment` | Mesh3D | distance to the body as colour | mesh file |
//! | `/parts/garment` | Mesh3D | colour per PART, each vertex showing its own cell | `table` |
//! | `/force/garment` | Mesh3D | resultant per PART as colour | `table` |
//! | `/force/arrows` | Arrows3D | one arrow per PART | `table` |
//! | `/parts/dots` | Points3D | a dot per PART, which says what it is when hovered over | `table` |
//! | `/drape/garment` | Mesh3D | the displaced garment | `table`, `iteration` |
//! | `/fit/<name>/garment` | Mesh3D | strain, pressure: per-vertex values on the drape | `table` |
//! | `/fit/folds/lines` | LineStrips3D | directions of the folds that no PART shows | `table` |
//! | `/pattern/parts/panels`, `/pattern/<name>/panels` | Mesh3D | the flat panels in the same colours | `table` |
//! | `/outfit/<k>-<name>/parts`, `.../force`, `.../drape` | Mesh3D | garments worn over each other, each by itself | `table` |
//! | `/wrinkles/seams/garment`, `.../lines` | Mesh3D, LineStrips3D | jump of the displacement at each seam | `table` |
//! | `/wrinkles/curvature/garment` | Mesh3D | mean curvature of the drape | `table` |
//! | `/error/garment` | Mesh3D | distance to the reference drape | `table` |
//! | `/report` | TextDocument | table, fabric, counts, timings, command line, versions | `table` |
//! | `/levels/histogram/<level>` | BarChart | how many vertices lie how far off, split by level | `table` |
//! | `/levels/parts/<level>` | BarChart | PARTs of each level | `table` |
//! | `/numbers/<name>` | Scalars | PART count, error, ... | `table` |
//! | `/numbers/ms/<stage>` | Scalars | time of each stage, ms | `table` |
//! | `/solver/energy`, `/solver/residual`, `.../residual_log10` | Scalars | J; residual over weight | `iteration` |
//! | `/method/<number>` | LineStrips3D, Mesh3D | what a reference method made on its way: quadrics, flying pieces, a limit surface | `iteration` |
//! | `/solver/speed` | Scalars | RMS speed of the vertices of a reference method, cm/s | `iteration` |
//! | `/rows` | a component per column | the same numbers with the table's name: a row per table | `table` |
//! | `/compare/<slot>/garment` | Mesh3D | 2–6 chosen tables side by side | `table` |
//! | `/legend/compare/<slot>` | Points2D | what each of them costs | `table` |
//! | `/legend/stages/table` | Points2D | the table's name | `table` |
//! | `/legend/<tab>/<name>/bar`, `.../ticks` | LineStrips2D, Points2D | colour bars of a tab, in one drawing | `table` |
//! | `/scatter/points`, `.../names`, `.../leaders`, `.../axes`, `.../ticks` | Points2D, LineStrips2D | time against error, a point per table | `table` |
//! | `/growth/points` and so on | the same | vertices against time, a point per way to drape and garment | `table` |

#![allow(missing_docs, reason = "the table above says what lies at each path")]

pub const BODY: &str = "/body";
pub const GARMENT: &str = "/garment";
pub const DISTANCE: &str = "/distance/garment";
pub const PARTS: &str = "/parts/garment";
pub const PART_DOTS: &str = "/parts/dots";
pub const FORCE: &str = "/force/garment";
pub const FORCE_ARROWS: &str = "/force/arrows";
pub const DRAPE: &str = "/drape/garment";
pub const FIT: &str = "/fit";
pub(crate) const PATTERN: &str = "/pattern";
pub(crate) const OUTFIT: &str = "/outfit";
pub(crate) const SEAMS: &str = "/wrinkles/seams";
pub(crate) const CURVATURE: &str = "/wrinkles/curvature";
pub(crate) const ERROR: &str = "/error";
pub const REPORT: &str = "/report";
pub(crate) const HISTOGRAM: &str = "/levels/histogram";
pub(crate) const LEVEL_PARTS: &str = "/levels/parts";
pub(crate) const NUMBERS: &str = "/numbers";
pub const ROWS: &str = "/rows";
pub(crate) const STAGE_MS: &str = "/numbers/ms";
pub(crate) const METHOD: &str = "/method";
pub(crate) const SPEED: &str = "/solver/speed";
pub const ENERGY: &str = "/solver/energy";
pub const RESIDUAL: &str = "/solver/residual";
pub const RESIDUAL_LOG10: &str = "/solver/residual_log10";
pub const COMPARE: &str = "/compare";
pub(crate) const SCATTER: &str = "/scatter";
pub(crate) const GROWTH: &str = "/growth";
pub const STAGES_LEGEND: &str = "/legend/stages";
pub const FIT_LEGEND: &str = "/legend/fit";
pub const WRINKLES_LEGEND: &str = "/legend/wrinkles";
pub(crate) const COMPARE_CAPTIONS: &str = "/legend/compare";

/// One step per range table (or per reload under `--watch`).
pub const TABLE: &str = "table";
/// The stages of one run: body 0, garment 1, distance 2, PARTs 3, force 4, drape 5, fit and error 6.
pub const STAGE: &str = "stage";
/// The iterations of the solver.
pub const ITERATION: &str = "iteration";
