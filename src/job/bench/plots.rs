//! Plots of the error against time as SVG, in tones that are legible on a light page and on a dark one.

use plotters::coord::Shift;
use plotters::coord::ranged1d::{AsRangedCoord, ValueFormatter};
use plotters::prelude::*;

use super::report::{Point, SubjectReport};
use crate::error::{Error, Result};

pub const ERROR_TIME: &str = "error_time.svg";
pub const PSNR_TIME: &str = "psnr_time.svg";
pub const SIMILARITY_TIME: &str = "similarity_time.svg";

const SIZE: (u32, u32) = (820, 460);
/// Text and axes: of the same contrast to white and to black.
const INK: RGBColor = RGBColor(128, 128, 128);
const FAINT: RGBAColor = RGBAColor(128, 128, 128, 0.25);
/// Okabe and Ito's colours for the colour-blind, without those that vanish on white or black.
const COLORS: [RGBColor; 6] = [
    RGBColor(230, 159, 0),
    RGBColor(0, 158, 115),
    RGBColor(86, 180, 233),
    RGBColor(213, 94, 0),
    RGBColor(204, 121, 167),
    RGBColor(0, 114, 178),
];

/// One curve: a name, its points, and whether it is dashed.
struct Curve {
    name: String,
    points: Vec<(f64, f64)>,
    color: RGBColor,
    is_dashed: bool,
}

/// The plots of a subject: their names and their SVG. Those without a point are left out.
pub fn all(subject: &SubjectReport) -> Result<Vec<(&'static str, String)>> {
    let mse = curves(subject, |p| p.error.mse);
    let psnr = curves(subject, |p| p.error.psnr);
    let alike = subject.similarity.iter().zip(1..).map(|(run, i)| Curve {
        name: run.variant.clone(),
        points: drawable(run.points.iter().map(|p| (p.asked_s, p.psnr))),
        color: COLORS[i % COLORS.len()],
        is_dashed: false,
    });
    let noise = subject.reference.noise.as_ref();
    // A reference without any noise has infinitely many decibels.
    let shown = |value: f64| (value > 0.0 && value.is_finite()).then_some(value);
    let plot = |is_logarithmic, what, curves: Vec<Curve>, floor: Option<f64>| {
        let span = Span::of(&curves, floor)?;
        Some(Plot {
            is_logarithmic,
            what,
            curves,
            floor,
            span,
        })
    };
    let floors = [
        noise.and_then(|n| shown(n.mse)),
        noise.and_then(|n| shown(n.psnr)),
    ];
    let plots = [
        (ERROR_TIME, plot(true, "mean squared error", mse, floors[0])),
        (
            PSNR_TIME,
            plot(false, "PSNR to the reference, dB", psnr, floors[1]),
        ),
        (
            SIMILARITY_TIME,
            plot(false, "PSNR to non-caching, dB", alike.collect(), None),
        ),
    ];
    let drawn = plots
        .into_iter()
        .filter_map(|(name, plot)| Some(draw(&plot?).map(|svg| (name, svg))));
    drawn.collect()
}

/// Solid curves for runs from cold, and dashed ones for new views from their warm caches.
fn curves(subject: &SubjectReport, value: impl Fn(&Point) -> f64) -> Vec<Curve> {
    let points = |points: &[Point]| drawable(points.iter().map(|p| (p.seconds, value(p))));
    let mut curves = Vec::new();
    for (i, run) in subject.runs.iter().enumerate() {
        let color = COLORS[i % COLORS.len()];
        curves.push(Curve {
            name: run.variant.clone(),
            points: points(&run.points),
            color,
            is_dashed: false,
        });
        if !run.new_view.is_empty() {
            curves.push(Curve {
                name: format!("{}, new view", run.variant),
                points: points(&run.new_view),
                color,
                is_dashed: true,
            });
        }
    }
    curves
}

/// The points that axes can show: pictures that are equal have no error, and infinitely many decibels.
fn drawable(points: impl Iterator<Item = (f64, f64)>) -> Vec<(f64, f64)> {
    points
        .filter(|&(s, y)| s > 0.0 && y > 0.0 && y.is_finite())
        .collect()
}

/// One picture; time runs on a logarithmic axis.
struct Plot {
    is_logarithmic: bool,
    /// Name of the values.
    what: &'static str,
    curves: Vec<Curve>,
    /// The level of the reference's noise.
    floor: Option<f64>,
    span: Span,
}

/// The ranges that the axes have to show.
struct Span {
    x: [f64; 2],
    y: [f64; 2],
}

impl Span {
    fn of(curves: &[Curve], floor: Option<f64>) -> Option<Span> {
        let points = || curves.iter().flat_map(|c| &c.points);
        points().next()?;
        let range = |values: &mut dyn Iterator<Item = f64>| {
            values.fold([f64::INFINITY, 0.0], |[low, high], v| {
                [low.min(v), f64::max(high, v)]
            })
        };
        Some(Span {
            x: range(&mut points().map(|p| p.0)),
            y: range(&mut points().map(|p| p.1).chain(floor)),
        })
    }
}

fn draw(plot: &Plot) -> Result<String> {
    let mut svg = String::new();
    let area = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
    let Span {
        x: [left, right],
        y: [low, high],
    } = plot.span;
    let times = (left / 1.3..right * 1.3).log_scale();
    let drawn = if plot.is_logarithmic {
        let values = (low / 1.6..high * 1.6).log_scale();
        on_axes(&area, times, values, plot, &scientific)
    } else {
        on_axes(&area, times, low - 2.0..high + 2.0, plot, &plain)
    };
    drawn.map_err(|e| Error::value(format!("a plot could not be drawn: {e}")))?;
    drop(area);
    Ok(svg)
}

type Drawn = std::result::Result<(), Box<dyn std::error::Error>>;

fn on_axes<X, Y>(
    area: &DrawingArea<SVGBackend<'_>, Shift>,
    times: X,
    values: Y,
    plot: &Plot,
    label: &dyn Fn(&f64) -> String,
) -> Drawn
where
    X: AsRangedCoord<Value = f64>,
    Y: AsRangedCoord<Value = f64>,
    X::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
    Y::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
{
    let Plot {
        what,
        curves,
        floor,
        span,
        ..
    } = plot;
    let text = ("sans-serif", 14).into_font().color(&INK);
    let mut chart = ChartBuilder::on(area)
        .margin(12)
        .margin_right(220)
        .x_label_area_size(44)
        .y_label_area_size(72)
        .build_cartesian_2d(times, values)?;
    chart
        .configure_mesh()
        .x_desc("seconds of rendering")
        .y_desc(*what)
        .x_label_formatter(&plain)
        .y_label_formatter(label)
        .label_style(text.clone())
        .axis_desc_style(text.clone())
        .axis_style(INK)
        .bold_line_style(FAINT)
        .light_line_style(TRANSPARENT)
        .draw()?;
    if let Some(y) = *floor {
        let ends = [(span.x[0], y), (span.x[1], y)];
        chart.draw_series(DashedLineSeries::new(ends, 2, 4, INK.stroke_width(1)))?;
    }
    for curve in curves {
        let points = || curve.points.iter().copied();
        if curve.is_dashed {
            let style = curve.color.stroke_width(2);
            chart.draw_series(DashedLineSeries::new(points(), 6, 4, style))?;
        } else {
            chart.draw_series(LineSeries::new(points(), curve.color.stroke_width(2)))?;
        }
        chart.draw_series(points().map(|p| Circle::new(p, 3, curve.color.filled())))?;
    }
    let named = curves
        .iter()
        .map(|c| (c.name.as_str(), c.color, c.is_dashed));
    let noise = floor.map(|_| ("the reference's noise", INK, true));
    key(area, named.chain(noise))
}

/// The legend of the colours, to the right of the axes.
fn key<'a>(
    area: &DrawingArea<SVGBackend<'_>, Shift>,
    names: impl Iterator<Item = (&'a str, RGBColor, bool)>,
) -> Drawn {
    let left = SIZE.0 as i32 - 210;
    for ((name, color, is_dashed), row) in names.zip(0..) {
        let y = 24 + 22 * row;
        let to = |x: i32| (left + x, y);
        let strokes = if is_dashed {
            vec![[to(0), to(9)], [to(15), to(24)]]
        } else {
            vec![[to(0), to(24)]]
        };
        for stroke in strokes {
            area.draw(&PathElement::new(stroke.to_vec(), color.stroke_width(2)))?;
        }
        let style = ("sans-serif", 13).into_font().color(&INK);
        area.draw(&Text::new(name.to_string(), (left + 32, y - 7), style))?;
    }
    Ok(())
}

fn plain(value: &f64) -> String {
    format!("{}", (value * 1e4).round() / 1e4)
}

fn scientific(value: &f64) -> String {
    format!("{value:.0e}")
}

#[cfg(test)]
mod tests {
    use super::super::report::{ReferenceReport, Similarity, SimilarityPoint};
    use super::*;

    /// A subject of which one variant shows the pictures of another, with so many decibels between them.
    fn alike(psnr: &[f64]) -> SubjectReport {
        let points = psnr.iter().zip(1..).map(|(&psnr, second)| SimilarityPoint {
            asked_s: f64::from(second),
            psnr,
            ssim: None,
        });
        SubjectReport {
            shading: None,
            prefix: String::new(),
            reference: ReferenceReport {
                file: String::new(),
                seconds: None,
                samples: None,
                noise: None,
            },
            reference_of_centres: None,
            runs: Vec::new(),
            similarity: vec![Similarity {
                variant: "caching".into(),
                points: points.collect(),
            }],
            cache_settings: Vec::new(),
            skipped: Vec::new(),
        }
    }

    #[test]
    fn equal_pictures_are_left_out_of_plots() {
        let names = |psnr: &[f64]| -> Vec<&str> {
            let plots = all(&alike(psnr)).expect("plots");
            plots.into_iter().map(|(name, _)| name).collect()
        };
        assert_eq!(names(&[40.0, f64::INFINITY, 42.0]), [SIMILARITY_TIME]);
        assert!(names(&[f64::INFINITY; 2]).is_empty());
    }
}
