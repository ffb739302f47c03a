//! The tabs that look closer at one drape: its wrinkles, and the solver's way to it.

use super::super::eye::Eye;
use super::super::paths;
use super::Node;
use super::layout::over;
use super::view::View;

pub(super) fn wrinkles(eye: &Eye) -> Node {
    let views = vec![
        (1.0, View::spatial("PARTs' displacements differ", &[paths::BODY, paths::SEAMS], eye).into()),
        (1.0, View::spatial("Mean curvature", &[paths::BODY, paths::CURVATURE], eye).into()),
    ];
    over("Wrinkles", views, "Colours", paths::WRINKLES_LEGEND, 2)
}

pub(super) fn solver(eye: &Eye) -> Node {
    let plots = vec![
        (1.0, View::plot("Energy, J", &[paths::ENERGY], true).into()),
        (1.0, View::plot("Residual over weight, log10", &[paths::RESIDUAL_LOG10], true).into()),
    ];
    Node::Row(
        "Solver",
        vec![(1.0, View::spatial("Drape", &[paths::BODY, "/drape"], eye).into()), (2.0, Node::Column("Solver", plots))],
    )
}
