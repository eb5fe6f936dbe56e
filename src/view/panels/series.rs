//! The volumes of the open folder, to pick from. Nothing here identifies the patient: a series' description, which a
//! technician types, is left out.
//!
//! The canvas draws with one texture, which holds the fonts. A thumbnail is therefore a mesh with a coloured corner
//! for each of its pixels, and only rows in sight are drawn.

use egui::{Align2, Color32, FontId, Mesh, Rect, Response, ScrollArea, Sense, Ui, pos2, vec2};

use crate::scene::volume::{Pick, Preview, Thumbnail};
use crate::view::keys::Action;
use crate::view::session::Session;

/// Points along a thumbnail's longer side.
const SIDE: f32 = 48.0;
const MARGIN: f32 = 4.0;
const ROW: f32 = SIDE + 2.0 * MARGIN;
/// Rows in sight at once.
const MOST_ROWS: f32 = 3.5;

/// Shows the list; returns the action for the volume that has been clicked.
pub fn show(ui: &mut Ui, session: &Session) -> Option<Action> {
    let series = &session.series;
    let shown = shown(session);
    let mut action = None;
    ScrollArea::vertical()
        .id_salt("series")
        .max_height(MOST_ROWS * ROW)
        .show_rows(ui, ROW, series.len(), |ui, rows| {
            for preview in &series[rows] {
                let number = preview.series.number;
                let is_shown = shown == Some(number);
                if row(ui, preview, is_shown).clicked() && !is_shown {
                    action = Some(Action::Series(number));
                }
            }
        });
    action
}

/// The number of the open volume.
fn shown(session: &Session) -> Option<u32> {
    match &session.document.opened.file.volume.series {
        None => Some(1),
        Some(Pick::Number(number)) => Some(*number),
        Some(Pick::Uid(uid)) => {
            let of_uid = |preview: &&Preview| preview.series.uid == *uid;
            let found = session.series.iter().find(of_uid);
            found.map(|preview| preview.series.number)
        }
    }
}

fn row(ui: &mut Ui, Preview { series, thumbnail }: &Preview, is_shown: bool) -> Response {
    let size = vec2(ui.available_width(), ROW);
    let (rect, response) = ui.allocate_exact_size(size, Sense::click());
    let visuals = ui.style().interact_selectable(&response, is_shown);
    let painter = ui.painter_at(rect);
    if is_shown || response.hovered() {
        painter.rect_filled(rect, 3.0, visuals.weak_bg_fill);
    }
    let square = Rect::from_min_size(rect.min + vec2(MARGIN, MARGIN), vec2(SIDE, SIDE));
    painter.rect_filled(square, 0.0, Color32::BLACK);
    if let Some(thumbnail) = thumbnail {
        painter.add(mesh(thumbnail, square));
    }
    let ([x, y, z], spacing) = (series.dims, series.spacing);
    let [a, b, c] = spacing.map(|size| (1e3 * size).round() / 1e3);
    let slices = match series.slices {
        1 => "1 slice".to_string(),
        count => format!("{count} slices"),
    };
    let modality = match series.modality.as_str() {
        "" => String::new(),
        modality => format!("{modality}, "),
    };
    let lines = [
        format!("{}: {modality}{slices}", series.number),
        format!("{x} × {y} × {z}"),
        format!("{a} × {b} × {c} mm"),
    ];
    for (n, line) in lines.into_iter().enumerate() {
        let at = pos2(square.right() + 8.0, square.top() + 16.0 * n as f32 + 8.0);
        let font = FontId::proportional(if n == 0 { 12.5 } else { 11.0 });
        painter.text(at, Align2::LEFT_CENTER, line, font, visuals.text_color());
    }
    if series.notes.is_empty() {
        response
    } else {
        response.on_hover_text(series.notes.join("\n"))
    }
}

/// The picture in the middle of a square, with its own proportions.
fn mesh(Thumbnail { size, levels }: &Thumbnail, square: Rect) -> Mesh {
    let [width, height] = size.map(|n| n as usize);
    let pixel = SIDE / width.max(height) as f32;
    let extent = vec2(width as f32, height as f32) * pixel;
    let low = square.center() - extent / 2.0;
    let high = low + extent;
    let mut mesh = Mesh::default();
    for (n, level) in levels.iter().enumerate() {
        let share = |at: usize, count: usize| at as f32 / (count - 1) as f32;
        let x = egui::lerp(low.x..=high.x, share(n % width, width));
        let y = egui::lerp(low.y..=high.y, share(n / width, height));
        mesh.colored_vertex(pos2(x, y), Color32::from_gray(*level));
    }
    for y in 0..height - 1 {
        for x in 0..width - 1 {
            let corner = (y * width + x) as u32;
            let below = corner + width as u32;
            mesh.add_triangle(corner, corner + 1, below);
            mesh.add_triangle(corner + 1, below + 1, below);
        }
    }
    mesh
}
