//! `isolume plan`: what a render would take of the GPU's memory, which variant it would be, and why.

use serde::Serialize;

use super::{open_scene, print};
use crate::cli::PlanArgs;
use crate::engine::Host;
use crate::error::Result;
use crate::gpu::human;
use crate::info::to_json;
use crate::render::{Choice, Plan};
use crate::scene::Opened;

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
    let host = Host::open(&args.gpu.host_options())?;
    let Opened { volume, scene, .. } = &opened;
    let Choice {
        plan,
        reason,
        next_better,
    } = host.plan(volume, scene)?;
    let budget = host.budget();
    let printed = Printed {
        variant: plan.variant.word(),
        reason: &reason,
        device: &host.summary().name,
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
