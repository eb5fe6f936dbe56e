//! Text and figures over the picture.

use std::time::{Duration, Instant};

use egui::{Align2, Area, Color32, Frame, Id, Order, Rect, RichText, Ui, Window};

use super::keys::help;
use super::live::Live;
use super::load::Load;
use super::recent::Recent;
use super::report::Report;
use super::session::Session;
use super::stage::Stage;
use crate::bytes::human;
use crate::cli::budget_source;
use crate::engine::figures::CacheStats;
use crate::engine::{BrickFigures, Choice};
use crate::gpu::Memory;

/// Width in points at which a sentence is broken.
const LONGEST_LINE: f32 = 330.0;

/// The overlays that are open.
#[derive(Default)]
pub struct Hud {
    pub shows_times: bool,
    pub shows_memory: bool,
    pub shows_help: bool,
}

/// A message about what happened last.
pub struct Message {
    text: String,
    pub is_error: bool,
    since: Instant,
}

/// Time after which a message disappears unless it is an error.
const LIFETIME: Duration = Duration::from_secs(5);

impl Message {
    pub fn new(text: String, is_error: bool) -> Message {
        Message {
            text,
            is_error,
            since: Instant::now(),
        }
    }

    pub fn is_old(&self) -> bool {
        !self.is_error && self.since.elapsed() > LIFETIME
    }
}

/// Frames a second, the picture's state, and the variant, in the upper left corner.
pub fn status(ui: &Ui, rect: Rect, session: &Session, report: &Report, memory: &MemoryNow) {
    let mut lines = Vec::new();
    if let Some(live) = session.live() {
        lines.push(headline(live, report));
        lines.extend(light(live));
        lines.extend(streaming(live));
        lines.push(format!(
            "{}: {} of {}",
            live.engine.choice().plan.variant.description(),
            human(memory.used),
            human(memory.budget)
        ));
    }
    if lines.is_empty() {
        return;
    }
    overlay(ui, "status", rect, Align2::LEFT_TOP, |ui| {
        ui.set_max_width((rect.width() - 40.0).max(80.0));
        for (i, line) in lines.iter().enumerate() {
            let text = RichText::new(line).size(11.0);
            ui.label(if i == 0 { text.strong() } else { text });
        }
        if let Some(live) = session.live() {
            let why = format!("because {}", live.engine.choice().reason);
            ui.response().on_hover_text(why);
        }
    });
}

fn headline(live: &Live, report: &Report) -> String {
    let picture = &live.picture;
    let samples = live.engine.totals().samples;
    let doing = picture.doing();
    if picture.is_moving() {
        // No frame has been timed yet where the mean is 0.
        let pace = match report.moving_ms() {
            0.0 => doing.into(),
            ms => format!("{:.0} frames/s", 1e3 / ms),
        };
        let pixels = 100.0 * picture.scale.powi(2);
        format!("{pace} at {pixels:.0} % of the pixels")
    } else if samples == 0 {
        doing.into()
    } else if picture.relative_error.is_finite() {
        let error = 100.0 * picture.relative_error;
        format!("{doing}: {samples} samples, error {error:.1} %")
    } else {
        format!("{doing}: {samples} samples")
    }
}

/// The progress of the cache's filling.
fn light(live: &Live) -> Option<String> {
    let CacheStats {
        active_cells: nodes,
        relative_error,
        ..
    } = live.engine.cache_stats(0.0)?;
    let error = if relative_error.is_finite() {
        format!("error {:.2} %", 100.0 * relative_error)
    } else {
        "error unknown yet".into()
    };
    let paths = match live.engine.updates() {
        1 => "1 path".to_string(),
        updates => format!("{updates} paths"),
    };
    Some(format!(
        "cache: {nodes} nodes, those in sight with {paths}, {error}"
    ))
}

/// The share of a volume that does not fit which is on the device.
fn streaming(live: &Live) -> Option<String> {
    let BrickFigures {
        resident, total, ..
    } = live.engine.brick_figures()?;
    Some(format!(
        "the volume streams: {resident} of {total} bricks are on the device"
    ))
}

/// The overlays that P, M and H open.
pub fn windows(ui: &Ui, hud: &mut Hud, report: &Report, live: Option<&Live>, memory: &MemoryNow) {
    type Rows = Vec<[String; 2]>;
    let open = |title: &str, is_open: &mut bool, at: [f32; 2], rows: Rows, above: Vec<String>| {
        Window::new(title)
            .open(is_open)
            .default_pos(at)
            .auto_sized()
            .show(ui.ctx(), |ui| table(ui, title, &rows, &above));
    };
    let time =
        |(name, recent): &(&str, Recent)| [name.to_string(), format!("{:.2} ms", recent.mean())];
    let times = report.passes().iter().map(time).collect();
    open(
        "GPU time",
        &mut hud.shows_times,
        [16.0, 80.0],
        times,
        Vec::new(),
    );
    let (rows, why) = (memory.rows(live), memory.sentences(live));
    open(
        "GPU memory",
        &mut hud.shows_memory,
        [190.0, 80.0],
        rows,
        why,
    );
    let help = help().map(|line| line.map(String::from)).collect();
    open(
        "Keys and mouse",
        &mut hud.shows_help,
        [60.0, 60.0],
        help,
        Vec::new(),
    );
}

/// Sentences, and rows of a name and a figure under them.
fn table(ui: &mut Ui, name: &str, rows: &[[String; 2]], above: &[String]) {
    ui.set_max_width(LONGEST_LINE);
    for sentence in above {
        ui.label(sentence);
    }
    // What is left of the window below the title and the sentences.
    let height = ui.ctx().content_rect().bottom() - ui.cursor().top() - 24.0;
    let scrolled = egui::ScrollArea::vertical().max_height(height.max(60.0));
    scrolled.show(ui, |ui| {
        egui::Grid::new(name).striped(true).show(ui, |ui| {
            for row in rows {
                for text in row {
                    ui.add(egui::Label::new(text).extend());
                }
                ui.end_row();
            }
        });
    });
}

/// Memory used and planned at the moment, for M and the status.
pub struct MemoryNow {
    used: u64,
    peak: u64,
    budget: u64,
    source: String,
    resources: Vec<[String; 2]>,
}

impl MemoryNow {
    pub fn of(stage: &Stage) -> MemoryNow {
        let memory: &Memory = &stage.memory;
        let row = |r: crate::gpu::ResourceBytes| [r.name.to_string(), human(r.bytes)];
        MemoryNow {
            used: memory.used(),
            peak: memory.peak(),
            budget: memory.budget,
            source: budget_source(stage.host.budget().source),
            resources: memory.resources().into_iter().map(row).collect(),
        }
    }

    /// The reason for this variant, the needs of the next better one, and the source of the budget.
    fn sentences(&self, live: Option<&Live>) -> Vec<String> {
        let choice = live.map(|live| live.engine.choice()).into_iter();
        let why = |c: &Choice| format!("{}, because {}.", c.plan.variant.word(), c.reason);
        // The reason may have said it.
        let better = |c: &Choice| {
            let is_new = !c.reason.contains(&c.next_better);
            is_new.then(|| format!("The next better variant: {}.", c.next_better))
        };
        let told = |c: &Choice| [Some(why(c)), better(c)].into_iter().flatten();
        let mut all: Vec<String> = choice.flat_map(|c| told(c).collect::<Vec<_>>()).collect();
        all.push(format!("The source of the budget: {}.", self.source));
        all
    }

    fn rows(&self, live: Option<&Live>) -> Vec<[String; 2]> {
        let planned = live.map_or(0, Live::planned_bytes);
        let mut rows = vec![
            ["in use".to_string(), human(self.used)],
            ["planned".to_string(), human(planned)],
            ["most at once".to_string(), human(self.peak)],
            ["budget".to_string(), human(self.budget)],
        ];
        rows.extend(self.resources.iter().cloned());
        rows
    }
}

/// A bar for the load under way.
pub fn progress<T: Send + 'static>(ui: &Ui, rect: Rect, load: &Load<T>) {
    overlay(ui, "progress", rect, Align2::CENTER_CENTER, |ui| {
        ui.label(RichText::new(&load.what).size(14.0));
        let seconds = load.took().as_secs_f32();
        match load.share() {
            Some(share) => {
                let bar = egui::ProgressBar::new(share as f32);
                let text = format!("{:.0} %, Esc cancels", 100.0 * share);
                ui.add(bar.desired_width(220.0).text(text));
            }
            None => {
                ui.label(format!("{seconds:.1} s"));
            }
        }
    });
}

pub fn message(ui: &Ui, rect: Rect, message: &Message) -> bool {
    let mut is_closed = false;
    overlay(ui, "message", rect, Align2::CENTER_BOTTOM, |ui| {
        ui.set_max_width((rect.width() - 60.0).max(80.0));
        let color = if message.is_error {
            Color32::from_rgb(255, 150, 130)
        } else {
            Color32::from_gray(220)
        };
        ui.label(RichText::new(&message.text).color(color));
        if message.is_error {
            is_closed = ui.small_button("close").clicked();
        }
    });
    is_closed
}

/// A dark plate over the picture, at one of its sides.
fn overlay(ui: &Ui, name: &str, rect: Rect, side: Align2, contents: impl FnOnce(&mut Ui)) {
    let inner = rect.shrink(8.0);
    let at = side.pos_in_rect(&inner);
    Area::new(Id::unique(name))
        .order(Order::Middle)
        .pivot(side)
        .fixed_pos(at)
        .constrain_to(rect)
        .show(ui.ctx(), |ui| {
            Frame::NONE
                .fill(Color32::from_black_alpha(215))
                .corner_radius(4)
                .inner_margin(6)
                .show(ui, |ui| {
                    ui.visuals_mut().override_text_color = Some(Color32::from_gray(225));
                    contents(ui);
                });
        });
}
