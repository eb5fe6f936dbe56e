//! `isolume plan`: what a render would take of the GPU's memory, which variant it would be, and why.

use serde::Serialize;

use super::{device_choice, open_scene, print};
use crate::cli::{self, PlanArgs};
use crate::error::{Error, Result};
use crate::gpu::{Device, human};
use crate::info::to_json;
use crate::render::shared::MOST_SURFACES;
use crate::render::{Choice, Plan, choose};
use crate::scene::Scene;
use crate::scene::file::Opened;

/// How much memory may be used, and who says so.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Budget {
    pub bytes: u64,
    pub source: String,
}

impl Budget {
    /// What the user allows, but never more than the device's heap holds.
    pub fn of(device: &Device, asked: Option<cli::Budget>) -> Budget {
        let heap = device.summary.device_local_bytes;
        let (bytes, source) = match asked {
            None => return device_budget(device),
            Some(cli::Budget::Bytes(bytes)) => (bytes, "--vram-budget".to_string()),
            Some(cli::Budget::Percent(share)) => (
                (heap as f64 * share / 100.0) as u64,
                format!("--vram-budget, {share} % of the heap"),
            ),
        };
        match bytes <= heap {
            true => Budget { bytes, source },
            false => Budget {
                bytes: heap,
                source: format!("the heap, which is smaller than {source}"),
            },
        }
    }
}

fn device_budget(device: &Device) -> Budget {
    let (bytes, source) = device.default_budget();
    Budget {
        bytes,
        source: source.into(),
    }
}

#[derive(Serialize)]
struct Printed<'a> {
    variant: &'a str,
    reason: &'a str,
    device: &'a str,
    budget_bytes: u64,
    budget_source: &'a str,
    planned_bytes: u64,
    #[serde(flatten)]
    plan: &'a Plan,
    /// What the next better variant would need.
    next_better: &'a str,
}

pub fn plan(args: &PlanArgs) -> Result<u8> {
    let opened = open_scene(&args.scene, false)?;
    check_supported(&opened.scene)?;
    let device = Device::open(&device_choice(args.gpu.device.as_ref()))?;
    let budget = Budget::of(&device, args.gpu.vram_budget);
    let Opened { volume, scene, .. } = &opened;
    let Choice {
        plan,
        reason,
        next_better,
    } = choose(&device, &device.summary, budget.bytes, volume, scene)?;
    let printed = Printed {
        variant: plan.variant(),
        reason: &reason,
        device: &device.summary.name,
        budget_bytes: budget.bytes,
        budget_source: &budget.source,
        planned_bytes: plan.bytes(),
        plan: &plan,
        next_better: &next_better,
    };
    match args.json {
        true => print(&to_json(&printed)?),
        false => print(&printed.table()),
    }
}

impl Printed<'_> {
    fn table(&self) -> String {
        let line = |name: &str, bytes: u64| format!("{name:<22} {bytes:>14}  {}\n", human(bytes));
        let resources = self.plan.resources.iter();
        let mut text: String = resources.map(|r| line(r.name, r.bytes)).collect();
        text += &line("in all", self.planned_bytes);
        text += &line("budget", self.budget_bytes);
        text += &format!("the budget is from {}\n", self.budget_source);
        text += &format!("device: {}\n", self.device);
        text += &format!("variant: {}, because {}\n", self.variant, self.reason);
        text += &format!("the next better variant: {}\n", self.next_better);
        text
    }
}

pub fn check_supported(scene: &Scene) -> Result<()> {
    let surfaces = scene.surfaces.iso.len();
    if surfaces > MOST_SURFACES {
        return Err(Error::Input(format!(
            "surfaces.iso: there are {surfaces} surfaces; at most {MOST_SURFACES} are possible"
        )));
    }
    Ok(())
}
