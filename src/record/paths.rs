//! The contents of a recording: entity paths and timelines.
//!
//! A recording with the solver's iterations opens on the timeline `iteration`; entities that change with `table` are logged at its first step too.
//!
//! | path | archetype | contents | changes with |
//! |---|---|---|---|
//! | `/body` | Mesh3D | the body | mesh file |
//! | `/garment` | Mesh3D | the garment as loaded | mesh file |
//! | `/distance/garment` | Mesh3D | distance to the body as colour | mesh file |
//! | `/parts/garment` | Mesh3D | colour per PART, one cell per vertex | `table` |
//! | `/force/garment` | Mesh3D | resultant per PART as colour | `table` |
//! | `/force/arrows` | Arrows3D | one arrow per PART | `table` |
//! | `/parts/dots` | Points3D | a dot per PART with a tooltip | `table` |
//! | `/drape/garment` | Mesh3D | the draped garment | `table`, `iteration` |
//! | `/fit/<name>/garment` | Mesh3D | strain, pressure: per-vertex values on the drape | `table` |
//! | `/fit/folds/lines` | LineStrips3D | directions of the folds narrower than a PART | `table` |
//! | `/pattern/parts/panels`, `/pattern/<name>/panels` | Mesh3D | the flat panels in the same colours | `table` |
//! | `/outfit/<k>-<name>/parts`, `.../force`, `.../drape` | Mesh3D | the layers of an outfit, each alone | `table` |
//! | `/wrinkles/seams/garment`, `.../lines` | Mesh3D, LineStrips3D | jump of the displacement at each seam | `table` |
//! | `/wrinkles/curvature/garment` | Mesh3D | mean curvature of the drape | `table` |
//! | `/error/garment` | Mesh3D | distance to the reference drape | `table` |
//! | `/report` | TextDocument | table, fabric, counts, timings, command line, versions | `table` |
//! | `/levels/histogram/<level>` | BarChart | number of vertices over distance, by level | `table` |
//! | `/levels/parts/<level>` | BarChart | PARTs of each level | `table` |
//! | `/numbers/<name>` | Scalars | PART count, error, ... | `table` |
//! | `/numbers/ms/<stage>` | Scalars | time of each stage, ms | `table` |
//! | `/solver/energy`, `/solver/residual`, `.../residual_log10` | Scalars | energy, J; residual over weight | `iteration` |
//! | `/method/<number>` | LineStrips3D, Mesh3D | intermediate results of a reference method: quadrics, moving patches, a limit surface | `iteration` |
//! | `/solver/speed` | Scalars | RMS speed of the vertices of a reference method, cm/s | `iteration` |
//! | `/rows` | a component per column | the same numbers with the table's name: a row per table | `table` |
//! | `/compare/<slot>/garment` | Mesh3D | 2–6 tables side by side | `table` |
//! | `/legend/compare/<slot>` | Points2D | PARTs, time and error of each | `table` |
//! | `/legend/stages/table` | Points2D | the table's name | `table` |
//! | `/legend/<tab>/<name>/bar`, `.../ticks` | LineStrips2D, Points2D | colour bars of a tab, in one drawing | `table` |
//! | `/scatter/points`, `.../names`, `.../leaders`, `.../axes`, `.../ticks` | Points2D, LineStrips2D | time against error, a point per table | `table` |
//! | `/outlines` | LineStrips2D | outlines of drape tests from above, mm | `table` |
//! | `/growth/points` and so on | the same | vertices against time, a point per method and garment | `table` |

pub(crate) const BODY: &str = "/body";
pub(crate) const GARMENT: &str = "/garment";
pub(crate) const DISTANCE: &str = "/distance/garment";
pub(crate) const PARTS: &str = "/parts/garment";
pub(crate) const PART_DOTS: &str = "/parts/dots";
pub(crate) const FORCE: &str = "/force/garment";
pub(crate) const FORCE_ARROWS: &str = "/force/arrows";
pub(crate) const DRAPE: &str = "/drape/garment";
pub(crate) const FIT: &str = "/fit";
pub(crate) const PATTERN: &str = "/pattern";
pub(crate) const OUTFIT: &str = "/outfit";
pub(crate) const SEAMS: &str = "/wrinkles/seams";
pub(crate) const CURVATURE: &str = "/wrinkles/curvature";
pub(crate) const OUTLINES: &str = "/outlines";
pub(crate) const ERROR: &str = "/error";
pub(crate) const REPORT: &str = "/report";
pub(crate) const HISTOGRAM: &str = "/levels/histogram";
pub(crate) const LEVEL_PARTS: &str = "/levels/parts";
pub(crate) const NUMBERS: &str = "/numbers";
pub(crate) const ROWS: &str = "/rows";
pub(crate) const STAGE_MS: &str = "/numbers/ms";
pub(crate) const METHOD: &str = "/method";
pub(crate) const SPEED: &str = "/solver/speed";
pub(crate) const ENERGY: &str = "/solver/energy";
pub(crate) const RESIDUAL: &str = "/solver/residual";
pub(crate) const RESIDUAL_LOG10: &str = "/solver/residual_log10";
pub(crate) const COMPARE: &str = "/compare";
pub(crate) const SCATTER: &str = "/scatter";
pub(crate) const GROWTH: &str = "/growth";
pub(crate) const STAGES_LEGEND: &str = "/legend/stages";
pub(crate) const FIT_LEGEND: &str = "/legend/fit";
pub(crate) const WRINKLES_LEGEND: &str = "/legend/wrinkles";
pub(crate) const COMPARE_CAPTIONS: &str = "/legend/compare";

/// One step per range table (or per reload under `--watch`).
pub(crate) const TABLE: &str = "table";
/// The stages of one run: body 0, garment 1, distance 2, PARTs 3, force 4, drape 5, fit and error 6.
pub(crate) const STAGE: &str = "stage";
/// The iterations of the solver.
pub(crate) const ITERATION: &str = "iteration";
