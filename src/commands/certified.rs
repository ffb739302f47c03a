//! A certificate, printed, and what it means for the exit code.

use crate::study::certificate::Certificate;

use super::console;

/// A certificate for people, where one was asked for.
pub(super) fn print(certificate: Option<&Certificate>) {
    let Some(certificate) = certificate else { return };
    let mut table = console::table(console::RULED, ["certificate", "", "found", "limit", "", ""], []);
    for f in &certificate.findings {
        let number =
            |x: f64| if x == 0.0 || (0.01..1e5).contains(&x.abs()) { format!("{x:.4}") } else { format!("{x:.2e}") };
        let found = if f.passes { "passes" } else { "FAILS" };
        table.add_row([
            f.name.to_owned(),
            found.to_owned(),
            number(f.value),
            number(f.limit),
            f.unit.to_owned(),
            f.remark.clone(),
        ]);
    }
    let verdict = if certificate.passes { "a drape at rest" } else { "not certified" };
    console::result(&format!("{table}\n{verdict}"));
}

/// Ends with 1 where a line fails.
pub(super) fn verified(certificate: Option<&Certificate>) -> anyhow::Result<()> {
    let failed = certificate.map_or(0, |c| c.findings.iter().filter(|f| !f.passes).count());
    anyhow::ensure!(failed == 0, "not certified: {failed} lines of the certificate fail");
    Ok(())
}
