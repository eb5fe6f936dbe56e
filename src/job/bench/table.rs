//! Tables of the report in Markdown, and numbers in them.

use std::fmt::Write;

use super::report::Report;

/// A table whose columns are the times of the report; `first` heads the first one.
pub fn by_time(first: &str, report: &Report) -> Table {
    let times = report.seconds.iter().map(|s| format!("{s} s"));
    let heads: Vec<String> = std::iter::once(first.to_string()).chain(times).collect();
    Table::new(&heads.iter().map(String::as_str).collect::<Vec<_>>())
}

/// Rows of a Markdown table.
pub struct Table {
    text: String,
    pub rows: usize,
}

impl Table {
    pub fn new(heads: &[&str]) -> Table {
        let rule = "|---".to_string() + &"|---:".repeat(heads.len() - 1);
        Table {
            text: format!("\n| {} |\n{rule}|\n", heads.join(" | ")),
            rows: 0,
        }
    }

    pub fn row(&mut self, cells: impl IntoIterator<Item = String>) {
        let cells: Vec<String> = cells.into_iter().collect();
        let _ = writeln!(self.text, "| {} |", cells.join(" | "));
        self.rows += 1;
    }

    pub fn by_time(&mut self, report: &Report, name: String, at: impl Fn(f64) -> Option<String>) {
        let cells = report.seconds.iter().map(|&s| at(s).unwrap_or("–".into()));
        self.row(std::iter::once(name).chain(cells));
    }

    pub fn text(self) -> String {
        self.text
    }
}

pub fn decibels(psnr: f64) -> String {
    if psnr.is_finite() {
        format!("{psnr:.1}")
    } else {
        "∞".into()
    }
}

/// A number with three significant digits.
pub fn number(value: f64) -> String {
    match value.abs() {
        0.0 => "0".into(),
        v if !v.is_finite() => "–".into(),
        v if v >= 1e5 => format!("{value:.2e}"),
        v if v >= 100.0 => format!("{value:.0}"),
        v if v >= 10.0 => format!("{value:.1}"),
        v if v >= 1e-2 => format!("{value:.3}"),
        _ => format!("{value:.2e}"),
    }
}
