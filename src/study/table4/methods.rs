//! Who takes part, on what, and what the paper printed.

use crate::garment::builtin::{BUILT_IN, TABLE_4_SIZES};
use crate::methods::{gross2003, thomaszewski2006, zhu2016};

/// A way to drape.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ComparedMethod {
    /// A reference method, by its name.
    Reference(&'static str),
    /// The paper's equations.
    Paper,
    /// The coupled model's two stages alone.
    Preview,
    /// The coupled model and then to rest.
    Converged,
}

impl ComparedMethod {
    /// Its name in tables and files.
    #[must_use]
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Reference(name) => name,
            Self::Paper => "paper",
            Self::Preview => "preview",
            Self::Converged => "converged",
        }
    }
    /// Its name for people: the paper's number of the reference, first author and year.
    #[must_use]
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
}

/// In the order of the columns.
pub(crate) const METHODS: [ComparedMethod; 6] = [
    ComparedMethod::Reference(zhu2016::NAME),
    ComparedMethod::Reference(gross2003::NAME),
    ComparedMethod::Reference(thomaszewski2006::NAME),
    ComparedMethod::Paper,
    ComparedMethod::Preview,
    ComparedMethod::Converged,
];

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

/// What Table 4 prints, ms: methods \[19\], \[20\], \[21\] and the paper's own, on an Intel Core i5 650 of 2010.
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

/// The paper's figures for a garment of so many vertices, ms: \[19\], \[20\], \[21\], proposed; `None` for what it has no row
/// for.
#[must_use]
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
