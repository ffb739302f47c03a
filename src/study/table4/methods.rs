//! The methods compared in Table 4, one run of each, and the times printed in the paper.

use std::ops::ControlFlow;
use std::time::Duration;

use glam::DVec3;

use crate::drape::{Model, Refine, Settings, StageTimes, drape};
use crate::garment::builtin::{BUILT_IN, TABLE_4_SIZES};
use crate::garment::fabric::Fabric;
use crate::mechanics::energy::Cloth;
use crate::mechanics::methods::{self, Ended, MethodInput, RestRule, gross2003, thomaszewski2006, zhu2016};
use crate::mechanics::refine::Stop;
use crate::scene::Scene;

/// A compared method.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ComparedMethod {
    /// A reference method, by its name.
    Reference(&'static str),
    /// The paper's equations.
    Paper,
    /// The coupled model's two stages alone.
    Preview,
    /// The coupled model's two stages, refined to convergence.
    Converged,
}

/// The compared methods, in the order of the columns.
pub(crate) const METHODS: [ComparedMethod; 6] = [
    ComparedMethod::Reference(zhu2016::NAME),
    ComparedMethod::Reference(gross2003::NAME),
    ComparedMethod::Reference(thomaszewski2006::NAME),
    ComparedMethod::Paper,
    ComparedMethod::Preview,
    ComparedMethod::Converged,
];

/// One drape with its time and its end.
pub(super) struct Outcome {
    pub(super) positions: Vec<DVec3>,
    pub(super) time: Duration,
    pub(super) ended: String,
    pub(super) steps: usize,
    pub(super) simulated_s: Option<f64>,
    pub(super) counts: Vec<(String, u64)>,
}

impl ComparedMethod {
    /// Name in tables and files.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Reference(name) => name,
            Self::Paper => "paper",
            Self::Preview => "preview",
            Self::Converged => "converged",
        }
    }

    /// Title in recordings: the paper's number of the reference, first author and year.
    pub(crate) fn title(self) -> &'static str {
        match self {
            Self::Reference(zhu2016::NAME) => "[19] Zhu 2016",
            Self::Reference(gross2003::NAME) => "[20] Groß 2003",
            Self::Reference(thomaszewski2006::NAME) => "[21] Thomaszewski 2006",
            Self::Reference(name) => name,
            Self::Paper => "The paper's equations",
            Self::Preview => "Our two stages",
            Self::Converged => "Our converged drape",
        }
    }

    /// Drapes the scene once.
    ///
    /// # Errors
    /// The reason why this method cannot drape the scene.
    pub(super) fn run(
        self,
        scene: &Scene,
        fabric: &Fabric,
        cloth: &Cloth,
        rule: &RestRule,
        go_on: &mut (dyn FnMut() -> ControlFlow<()> + Send),
    ) -> Result<Outcome, String> {
        let (model, refine) = match self {
            Self::Reference(name) => {
                return run_reference(name, &MethodInput { scene, fabric: &cloth.fabrics[0], cloth }, rule, go_on);
            }
            Self::Paper => ("paper", Refine::Steps(0)),
            Self::Preview => ("coupled", Refine::Steps(0)),
            Self::Converged => ("coupled", Refine::Converged),
        };
        let model = Model::by_name(model).unwrap_or_default();
        let settings = Settings { model, refine, fabric: fabric.clone(), ..Settings::default() };
        let drape = drape(scene, &settings, &mut |_| go_on()).map_err(|e| e.to_string())?;
        let StageTimes { distance, segment, cloth, mechanics, refine, .. } = drape.times;
        let ended = match (self, drape.state.as_ref().map(|s| s.stop)) {
            (_, Some(Stop::Interrupted)) => "interrupted",
            (Self::Converged, Some(Stop::Converged)) => "converged",
            (Self::Converged, Some(Stop::Stalled)) => "stalled",
            (Self::Converged, Some(Stop::Unsettled(_))) => "unsettled",
            (Self::Converged, _) => "steps-done",
            _ => "two-stages",
        };
        Ok(Outcome {
            positions: drape.positions,
            time: distance + segment + cloth + mechanics + refine,
            ended: ended.to_owned(),
            steps: drape.state.map_or(0, |s| s.steps),
            simulated_s: None,
            counts: vec![("PARTs".to_owned(), drape.parts.len() as u64)],
        })
    }
}

fn run_reference(
    name: &str,
    dressing: &MethodInput<'_>,
    rule: &RestRule,
    go_on: &mut (dyn FnMut() -> ControlFlow<()> + Send),
) -> Result<Outcome, String> {
    let method = methods::by_name(name, false, None).ok_or_else(|| format!("there is no method {name}"))?;
    let drape = method.drape(dressing, rule, &mut |_| go_on()).map_err(|e| e.to_string())?;
    let ended = match drape.ended {
        Ended::AtRest => "at-rest",
        Ended::TimeOver => "time-over",
        Ended::Interrupted => "interrupted",
    };
    Ok(Outcome {
        positions: drape.positions,
        time: drape.total,
        ended: ended.to_owned(),
        steps: drape.steps,
        simulated_s: Some(drape.simulated_s),
        counts: drape.counts.into_iter().map(|(name, count)| (name.to_owned(), count)).collect(),
    })
}

/// The ten rows of Table 4: garment and vertices.
pub(crate) const TEN_ROWS: [(&str, usize); 10] = {
    let mut rows = [("", 0); 10];
    let mut i = 0;
    while i < rows.len() {
        rows[i] = (BUILT_IN[i / 2], TABLE_4_SIZES[i / 2][i % 2]);
        i += 1;
    }
    rows
};

/// Times printed in Table 4, ms: methods \[19\], \[20\], \[21\] and the paper's own, on an Intel Core i5 650 of 2010.
const PRINTED: [[f64; 4]; 10] = [
    [1012.0, 1133.0, 1257.0, 898.0],
    [960.0, 1084.0, 1189.0, 834.0],
    [1002.0, 1125.0, 1198.0, 970.0],
    [940.0, 1057.0, 1087.0, 912.0],
    [859.0, 965.0, 998.0, 727.0],
    [824.0, 929.0, 979.0, 686.0],
    [1322.0, 1454.0, 1519.0, 1278.0],
    [1213.0, 1369.0, 1489.0, 1196.0],
    [2204.0, 2410.0, 2687.0, 1823.0],
    [1992.0, 2109.0, 2478.0, 1727.0],
];

/// The paper's times for a garment of this size, ms: \[19\], \[20\], \[21\], proposed; `None` if the paper has no such row.
pub(crate) fn printed_ms(garment: &str, vertices: usize) -> Option<[f64; 4]> {
    TEN_ROWS.iter().position(|row| *row == (garment, vertices)).map(|i| PRINTED[i])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rows_are_the_papers() {
        assert_eq!(TEN_ROWS[0], ("pullover-1", 5103));
        assert_eq!(TEN_ROWS[9], ("long-sleeved-dress", 9867));
        assert_eq!(printed_ms("flared-skirt", 3613), Some([824.0, 929.0, 979.0, 686.0]));
        assert_eq!(printed_ms("flared-skirt", 3614), None);
    }

    #[test]
    fn the_papers_averages_come_out_of_its_figures() {
        // The text gives them for the methods in the order [19], [20], [21], with its own 1105.1 put first.
        let mean = |column: usize| PRINTED.iter().map(|row| row[column]).sum::<f64>() / 10.0;
        assert_eq!([3, 0, 1, 2].map(mean), [1105.1, 1232.8, 1363.5, 1488.1]);
    }
}
