//! The choice where the whole volume is on the device.

use super::refusal::too_small;
use super::{Choice, Plan, Planner};
use crate::bytes::{exactly, human};
use crate::error::{Error, Result};
use crate::render::layout::describe_cache;
use crate::scene::Variant;

impl Planner<'_> {
    /// The best variant that fits with the volume whole.
    pub(super) fn choose_whole(&self) -> Result<Choice> {
        if let Some([why, next_better]) = self.why_no_cache() {
            return Ok(Choice {
                plan: self.fitting_without_cache(None)?,
                reason: why.into(),
                next_better: next_better.into(),
            });
        }
        let wanted = self.scene.render.variant;
        // What is in the way of the better cache that needs least.
        let mut better: Option<Obstacle> = None;
        for rung in self.rungs() {
            let name = describe_cache(rung.scale, rung.format);
            let layout = rung.layout.map_err(Error::from);
            let cached = layout.map(|layout| self.uncached.clone().with_cache(layout));
            let planned = cached.and_then(|cached| self.plan(&cached));
            match self.why_not(&planned) {
                Some(Obstacle { needed, why }) => {
                    if better.as_ref().is_none_or(|better| needed <= better.needed) {
                        let why = format!("{name} {why}");
                        better = Some(Obstacle { needed, why });
                    }
                }
                None => {
                    let plan = planned?;
                    let better = better.map(|better| better.why);
                    return Ok(Choice {
                        reason: reason(&plan, wanted, better.as_deref()),
                        next_better: better.unwrap_or("there is none".into()),
                        plan,
                    });
                }
            }
        }
        let better = better.map(|better| better.why);
        if wanted == Variant::Caching {
            let without = self.fitting_without_cache(better.clone())?;
            let smallest_cache = better.unwrap_or_default();
            return Err(self.no_cache(&without, smallest_cache).into());
        }
        let next_better = better.unwrap_or_default();
        Ok(Choice {
            plan: self.fitting_without_cache(Some(next_better.clone()))?,
            reason: format!("no cache fits beside the whole volume: {next_better}"),
            next_better,
        })
    }

    fn fitting_without_cache(&self, smallest_cache: Option<String>) -> Result<Plan> {
        let plan = self.plan(&self.uncached)?;
        if plan.bytes() <= self.budget {
            Ok(plan)
        } else {
            Err(too_small(&plan, self.budget, smallest_cache).into())
        }
    }

    /// What is in the way of a planned cache. `None` for one that fits, and for errors that have nothing to do with memory.
    fn why_not(&self, planned: &Result<Plan>) -> Option<Obstacle> {
        let (needed, why) = match planned {
            Ok(plan)
                if let Some(nodes) = plan.variant.cache().and_then(|c| self.too_many_nodes(c)) =>
            {
                let bytes = human(plan.bytes());
                let why = format!(
                    "has {nodes} nodes, which are too many for a CPU to fill for a picture of this size, and needs {bytes}"
                );
                (u64::MAX, why)
            }
            Ok(plan) if plan.bytes() > self.budget => {
                let bytes = plan.bytes();
                (bytes, format!("needs {}", exactly(bytes)))
            }
            Err(Error::Memory(why)) => (u64::MAX, format!("is impossible: {why}")),
            Ok(_) | Err(_) => return None,
        };
        Some(Obstacle { needed, why })
    }
}

/// What is in the way of a cache.
struct Obstacle {
    /// The budget with which it would fit; the largest number where no budget helps.
    needed: u64,
    /// The end of a sentence that begins with the cache's name.
    why: String,
}

/// Why the plan's variant was chosen, as the end of a sentence. Without its bytes, since an edit may replace the plan.
fn reason(plan: &Plan, wanted: Variant, better: Option<&str>) -> String {
    let asked = match wanted {
        Variant::Caching => "it was asked for, and ",
        _ => "",
    };
    let chosen = plan.variant.description();
    match better {
        None => format!("{asked}no variant is better than {chosen}"),
        Some(why) => format!("{asked}it is the best that fits: {chosen}; {why}"),
    }
}
