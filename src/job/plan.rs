//! `isolume plan`: the GPU memory that a render would take, its variant, and the reason for that variant.

use serde::Serialize;

use super::{open_scene, print};
use crate::bytes::human;
use crate::cli::{PlanArgs, budget_source};
use crate::engine::{BrickLayout, Choice, Host, Picture, Plan};
use crate::error::Result;
use crate::output::to_json;
use crate::scene::Opened;

#[derive(Serialize)]
struct Printed<'a> {
    variant: &'a str,
    reason: &'a str,
    device: &'a str,
    budget_bytes: u64,
    budget_source: String,
    planned_bytes: u64,
    /// Bytes of the host's memory that the picture takes beside that, about.
    picture_host_bytes: u64,
    #[serde(flatten)]
    plan: &'a Plan,
    /// `None` unless the volume does not fit.
    #[serde(skip_serializing_if = "Option::is_none")]
    bricks: Option<Bricks>,
    /// What the next better variant would need.
    next_better: &'a str,
}

#[derive(Serialize)]
struct Bricks {
    /// Voxels along a side.
    side: u32,
    total: u32,
    /// Bricks in which the medium scatters or a surface shows.
    needed: u32,
    /// The needed bricks for which there is room on the GPU, and their share of all needed ones.
    resident: u32,
    share: f64,
    /// Bytes of the host's memory for bricks.
    host_bytes: u64,
    /// Bytes to be read from the volume by the first samples, and by later ones that are taken together, if they bring every
    /// needed brick once.
    first_read_bytes: u64,
    later_read_bytes: u64,
}

impl Bricks {
    fn of(layout: &BrickLayout, needed: u32, voxel_bytes: usize, host_bytes: u64) -> Bricks {
        let first_read_bytes = u64::from(needed) * layout.brick_bytes(voxel_bytes);
        let resident = layout.capacity().min(needed);
        Bricks {
            side: layout.side,
            total: layout.total(),
            needed,
            resident,
            share: f64::from(resident) / f64::from(needed.max(1)),
            host_bytes,
            first_read_bytes,
            later_read_bytes: if needed <= layout.capacity() {
                0
            } else {
                first_read_bytes.saturating_sub(host_bytes)
            },
        }
    }
}

pub fn plan(args: &PlanArgs) -> Result<u8> {
    let opened = open_scene(&args.scene, false)?;
    let host = Host::open(&args.gpu.host_options())?;
    let Opened { volume, scene, .. } = &opened;
    let Choice {
        plan,
        reason,
        next_better,
    } = host.plan(volume, scene)?;
    let budget = host.budget();
    let bricks = plan.bricks.map(|layout| {
        let needed = host.needed_bricks(volume, scene);
        Bricks::of(&layout, needed, volume.stored.bytes(), host.ram_budget())
    });
    let printed = Printed {
        bricks,
        variant: plan.variant.word(),
        reason: &reason,
        device: &host.summary().name,
        budget_bytes: budget.bytes,
        budget_source: budget_source(budget.source),
        planned_bytes: plan.bytes(),
        picture_host_bytes: Picture::host_bytes(scene.render.size, false),
        plan: &plan,
        next_better: &next_better,
    };
    if args.json {
        print(&to_json(&printed)?)
    } else {
        print(&printed.table())
    }
}

impl Printed<'_> {
    fn table(&self) -> String {
        let line = |name: &str, bytes: u64| format!("{name:<22} {bytes:>14}  {}\n", human(bytes));
        let resources = self.plan.resources.iter();
        let mut text: String = resources.map(|r| line(r.name, r.bytes)).collect();
        text += &line("in all", self.planned_bytes);
        text += &line("budget", self.budget_bytes);
        text += &format!("source of the budget: {}\n", self.budget_source);
        text += &format!(
            "besides, the picture takes about {} of the host's memory\n",
            human(self.picture_host_bytes)
        );
        if let Some(bricks) = &self.bricks {
            let Bricks {
                side,
                total,
                needed,
                resident,
                share,
                host_bytes,
                first_read_bytes,
                later_read_bytes,
            } = bricks;
            text += &format!(
                "the volume streams: {total} bricks of {side} voxels a side, of which {needed} are needed and {resident} of \
                 these are on the GPU at a time ({:.0} %)\n",
                100.0 * share
            );
            text += &format!(
                "bricks take at most {} of the host's memory\n",
                human(*host_bytes)
            );
            text += &format!(
                "if each brick is loaded once, the first samples read up to {} of the file, and each later group of \
                 samples up to {}\n",
                human(*first_read_bytes),
                human(*later_read_bytes),
            );
        }
        text += &format!("device: {}\n", self.device);
        text += &format!("variant: {}, because {}\n", self.variant, self.reason);
        text += &format!("the next better variant: {}\n", self.next_better);
        text
    }
}
