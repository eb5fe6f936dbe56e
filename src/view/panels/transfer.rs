//! The transfer function over the histogram: points to drag, a double click for a new point, a right click or Delete
//! to remove one.
//!
//! Useful opacities range from 0.003 to 1, so the axis shows their square root; counts of voxels differ by more, so
//! theirs is logarithmic.

use egui::{Color32, Key, Mesh, Painter, Pos2, Rect, Sense, Shape, Stroke, Ui, Vec2, pos2};

use super::{Field, color, display, least_step};
use crate::scene::volume::Histogram;
use crate::scene::{Medium, TransferPoint};
use crate::view::session::Session;

const HEIGHT: f32 = 120.0;
const POINT: f32 = 5.0;
/// Margin around the plot, so that points at its border are wholly visible.
const MARGIN: f32 = 6.0;
const BARS: Color32 = Color32::from_gray(74);

pub fn show(ui: &mut Ui, session: &mut Session) {
    let document = session.document.clone();
    let Some(medium) = &mut session.scene.medium else {
        ui.weak("There is no medium.");
        return;
    };
    // While a point is dragged, the axis does not move under the pointer.
    let is_dragging = ui.input(|i| i.pointer.any_down());
    let range = match session.chosen.range.filter(|_| is_dragging) {
        Some(range) => range,
        None => shown_range(medium, document.range()),
    };
    session.chosen.range = Some(range);
    let plot = Plot::new(ui, range, HEIGHT);
    plot.draw_histogram(&document.histogram);
    plot.draw_function(medium);
    edit(ui, &plot, medium, &mut session.chosen.point);
    strip(ui, &plot, medium);
    chosen_point(ui, medium, session.chosen.point);
}

/// The data's range, extended to points outside it, and never empty.
fn shown_range(medium: &Medium, [low, high]: [f64; 2]) -> [f64; 2] {
    let values = medium.transfer.iter().map(|p| p.value);
    let low = values.clone().fold(low, f64::min);
    [
        low,
        values
            .fold(high, f64::max)
            .max(low + least_step(low).max(1e-9)),
    ]
}

/// A histogram with some values marked.
pub fn histogram(
    ui: &mut Ui,
    histogram: &Histogram,
    range: [f64; 2],
    height: f32,
    marks: &[(f64, Color32)],
) {
    let plot = Plot::new(ui, range, height);
    plot.draw_histogram(histogram);
    for (value, color) in marks {
        let x = plot.x(*value);
        let ends = [pos2(x, plot.area.top()), pos2(x, plot.area.bottom())];
        plot.painter.line_segment(ends, Stroke::new(2.0, *color));
    }
}

/// A plot with values to the right and opacities upwards.
struct Plot {
    area: Rect,
    range: [f64; 2],
    painter: Painter,
    response: egui::Response,
}

impl Plot {
    fn new(ui: &mut Ui, range: [f64; 2], height: f32) -> Plot {
        let size = Vec2::new(ui.available_width(), height);
        let (response, painter) = ui.allocate_painter(size, Sense::click());
        painter.rect_filled(response.rect, 3.0, Color32::from_gray(22));
        Plot {
            area: response.rect.shrink(MARGIN),
            range,
            painter,
            response,
        }
    }

    fn x(&self, value: f64) -> f32 {
        let [low, high] = self.range;
        self.area.left() + ((value - low) / (high - low)) as f32 * self.area.width()
    }

    fn at(&self, value: f64, opacity: f64) -> Pos2 {
        let y = self.area.bottom() - opacity.sqrt() as f32 * self.area.height();
        pos2(self.x(value), y)
    }

    /// The value and the opacity at a place on the screen.
    fn under(&self, p: Pos2) -> (f64, f64) {
        let [low, high] = self.range;
        let t = ((p.x - self.area.left()) / self.area.width()) as f64;
        let height = ((self.area.bottom() - p.y) / self.area.height()) as f64;
        let value = low + t.clamp(0.0, 1.0) * (high - low);
        (value, height.clamp(0.0, 1.0).powi(2))
    }

    fn draw_histogram(&self, histogram: &Histogram) {
        let most = histogram.counts.iter().copied().max().unwrap_or(1);
        let scale = 1.0 / (1.0 + most as f64).ln();
        let mut mesh = Mesh::default();
        for (bin, &count) in histogram.counts.iter().enumerate().filter(|(_, c)| **c > 0) {
            let half = 0.5 * histogram.width;
            let value = histogram.value(bin);
            let height = ((1.0 + count as f64).ln() * scale) as f32 * self.area.height();
            let left = self.x(value - half).max(self.area.left());
            let right = self.x(value + half).min(self.area.right());
            let top = self.area.bottom() - height;
            let bar = Rect::from_min_max(pos2(left, top), pos2(right, self.area.bottom()));
            mesh.add_colored_rect(bar, BARS);
        }
        self.painter.add(Shape::mesh(mesh));
    }

    fn draw_function(&self, medium: &Medium) {
        let points = &medium.transfer;
        let [low, high] = self.range;
        let (Some(first), Some(last)) = (points.first(), points.last()) else {
            return;
        };
        let ends = [self.at(low, first.opacity), self.at(high, last.opacity)];
        let inner = points.windows(2).flat_map(|pair| self.curve(pair));
        let last = self.at(last.value, last.opacity);
        let line: Vec<Pos2> = std::iter::once(ends[0])
            .chain(inner)
            .chain([last, ends[1]])
            .collect();
        self.painter
            .add(Shape::line(line, Stroke::new(1.5, Color32::from_gray(200))));
    }

    /// A segment between two points: linear in opacity, and thus curved on this axis.
    fn curve(&self, pair: &[TransferPoint]) -> impl Iterator<Item = Pos2> + '_ {
        const STEPS: u32 = 8;
        let (a, b) = (pair[0], pair[1]);
        (0..STEPS).map(move |i| {
            let t = f64::from(i) / f64::from(STEPS);
            let mix = |a: f64, b: f64| a + t * (b - a);
            self.at(mix(a.value, b.value), mix(a.opacity, b.opacity))
        })
    }
}

/// Points that can be dragged between their neighbours, added and removed.
fn edit(ui: &mut Ui, plot: &Plot, medium: &mut Medium, chosen: &mut usize) {
    let points = &mut medium.transfer;
    let mut removed = None;
    for i in 0..points.len() {
        if handle(ui, plot, points, i, chosen) {
            removed = Some(i);
        }
    }
    if deletes(ui, plot) {
        removed = Some(*chosen);
    }
    if let Some(i) = removed.filter(|i| points.len() > 1 && *i < points.len()) {
        points.remove(i);
        *chosen = i.min(points.len() - 1);
    }
    if plot.response.double_clicked()
        && let Some(at) = plot.response.interact_pointer_pos()
    {
        *chosen = insert(medium, plot.under(at));
    }
}

/// A point's handle on the plot. Returns whether the point is to be removed.
fn handle(
    ui: &mut Ui,
    plot: &Plot,
    points: &mut [TransferPoint],
    i: usize,
    chosen: &mut usize,
) -> bool {
    let place = plot.at(points[i].value, points[i].opacity);
    let area = Rect::from_center_size(place, Vec2::splat(3.0 * POINT));
    let id = ui.scope_id().with(("transfer", i));
    let response = ui.interact(area, id, Sense::click_and_drag());
    if response.drag_started() || response.clicked() {
        *chosen = i;
    }
    if response.dragged()
        && let Some(at) = response.interact_pointer_pos()
    {
        let (value, opacity) = plot.under(at);
        let [least, most] = room(points, i);
        points[i].value = value.clamp(least, most);
        points[i].opacity = opacity;
    }
    let is_lit = *chosen == i || response.hovered();
    let (radius, ring) = if is_lit {
        (1.25 * POINT, Color32::WHITE)
    } else {
        (POINT, Color32::BLACK)
    };
    let filled = display(points[i].color);
    plot.painter
        .circle(place, radius, filled, Stroke::new(1.5, ring));
    response.secondary_clicked()
}

/// The values that a point can have between its neighbours. A scene file's values must be within a float's range, so where
/// there is no neighbour the limit is half of that, or the point's own value if it is beyond.
fn room(points: &[TransferPoint], i: usize) -> [f64; 2] {
    let beyond = f64::from(f32::MAX) / 2.0;
    let now = points[i].value;
    let before = i.checked_sub(1).map(|n| points[n].value);
    let after = points.get(i + 1).map(|point| point.value);
    [
        before.unwrap_or(now.min(-beyond)),
        after.unwrap_or(now.max(beyond)),
    ]
}

/// Whether the Delete key is meant for the plot.
fn deletes(ui: &Ui, plot: &Plot) -> bool {
    let is_typing = ui.ctx().egui_wants_keyboard_input();
    // A point that is removed while it is dragged would leave the drag to its neighbour.
    let is_asked = ui.input(|i| i.key_pressed(Key::Delete) && !i.pointer.any_down());
    plot.response.contains_pointer() && !is_typing && is_asked
}

/// Adds a point in the colour that is there, and returns its index.
fn insert(medium: &mut Medium, (value, opacity): (f64, f64)) -> usize {
    let (_, color) = medium.classify(value);
    let index = medium.transfer.partition_point(|p| p.value <= value);
    let point = TransferPoint {
        value,
        opacity,
        color,
    };
    medium.transfer.insert(index, point);
    index
}

/// The colours, under the plot.
fn strip(ui: &mut Ui, plot: &Plot, medium: &Medium) {
    const STEPS: usize = 64;
    let size = Vec2::new(ui.available_width(), 10.0);
    let (response, painter) = ui.allocate_painter(size, Sense::hover());
    let rect = response.rect.shrink2(Vec2::new(MARGIN, 0.0));
    let [low, high] = plot.range;
    let mut mesh = Mesh::default();
    for step in 0..=STEPS {
        let t = step as f32 / STEPS as f32;
        let (_, rgb) = medium.classify(low + f64::from(t) * (high - low));
        let x = rect.left() + t * rect.width();
        mesh.colored_vertex(pos2(x, rect.top()), display(rgb));
        mesh.colored_vertex(pos2(x, rect.bottom()), display(rgb));
        if step > 0 {
            let n = 2 * step as u32;
            mesh.add_triangle(n - 2, n - 1, n);
            mesh.add_triangle(n - 1, n, n + 1);
        }
    }
    painter.add(Shape::mesh(mesh));
}

fn chosen_point(ui: &mut Ui, medium: &mut Medium, chosen: usize) {
    let points = &mut medium.transfer;
    if points.is_empty() {
        return;
    }
    let i = chosen.min(points.len() - 1);
    let [least, most] = room(points, i);
    let point = &mut points[i];
    ui.horizontal(|ui| {
        color(ui, &mut point.color);
        let number = |ui: &mut Ui, name: &str, number: &mut f64, range, speed, decimals| {
            let field = Field::of(ui, *number);
            let drag = egui::DragValue::new(number)
                .range(range)
                .speed(speed)
                .max_decimals(decimals)
                .custom_formatter(|value, decimals| field.shown(value, decimals))
                .custom_parser(|text| field.read(text))
                .update_while_editing(false);
            ui.add(drag).on_hover_text(name);
        };
        number(ui, "value", &mut point.value, least..=most, 1.0, 3);
        number(ui, "opacity", &mut point.opacity, 0.0..=1.0, 0.002, 4);
    });
}
