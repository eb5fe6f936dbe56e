//! What holds for every budget: the choice fits, more memory never buys less, and what is said of the
//! next better one is true.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use isolume::gpu::{Device, DeviceSummary};
use isolume::render::{Choice, Planner};
use isolume::scene::Scene;
use isolume::scene::volume::Volume;

use crate::memory_plan::devices::{lavapipe, nvidia_8};
use crate::memory_plan::{Kind, LADDER, dense, name, plan, scene, sparse, with_everything};

const BUDGETS: u32 = 200;

struct Ladder {
    device: Arc<Device>,
    limits: DeviceSummary,
    volume: Volume,
    scene: Scene,
    /// Bytes that a rung needs, by name.
    needs: BTreeMap<String, u64>,
}

impl Ladder {
    fn new(limits: DeviceSummary, volume: Volume, scene: Scene) -> Ladder {
        let device = crate::support::common::device();
        let needs = |&rung| {
            let plan = plan(&device, &limits, &volume, &scene, rung).expect("a plan");
            (name(rung), plan.bytes())
        };
        let needs = LADDER.iter().map(needs).collect();
        Ladder {
            device,
            limits,
            volume,
            scene,
            needs,
        }
    }

    fn choose(&self, budget: u64) -> Option<Choice> {
        let choose = |budget| {
            let Ladder {
                device,
                limits,
                volume,
                scene,
                ..
            } = self;
            Planner::new(device, limits, budget, volume, scene).choose()
        };
        match choose(budget) {
            // A volume in bricks stands below the ladder.
            Ok(choice) if choice.plan.bricks.is_some() => {
                let (_, whole) = choice
                    .next_better
                    .rsplit_once(';')
                    .unwrap_or(("", &choice.next_better));
                assert_eq!(
                    stated_bytes(whole),
                    Some(self.needs["non-caching"]),
                    "{choice:?}"
                );
                None
            }
            Ok(choice) => Some(choice),
            Err(error) => {
                assert_eq!(error.exit_status(), 4, "{error}");
                // What is asked for is the least that is enough, be it with the volume in bricks.
                let needed = stated_bytes(&error.to_string()).expect("a need");
                assert!(budget < needed, "{error}");
                assert!(needed <= self.needs["non-caching"], "{error}");
                assert!(choose(needed).is_ok(), "{error}");
                assert!(choose(needed - 1).is_err(), "{error}");
                None
            }
        }
    }

    /// From too little for anything to plenty, and around each rung's edge.
    fn budgets(&self) -> BTreeSet<u64> {
        let least = *self.needs.values().min().expect("rungs") as f64 * 0.8;
        let most = *self.needs.values().max().expect("rungs") as f64 * 1.5;
        let share = |n: u32| f64::from(n) / f64::from(BUDGETS - 1);
        let evenly = (0..BUDGETS).map(|n| (least * (most / least).powf(share(n))) as u64);
        let edges = self.needs.values().flat_map(|&n| [n - 1, n, n + 1]);
        evenly.chain(edges).collect()
    }

    /// The names of the rungs from `first` on, from worst to best, without those that need no less than
    /// a better one: a driver may round both up to the same size.
    fn worth_taking(&self, first: usize) -> Vec<String> {
        let needs = |n: usize| self.needs[&name(LADDER[n])];
        let is_cheaper = |&n: &usize| (first..n).all(|better| needs(better) > needs(n));
        let rungs = (first..LADDER.len()).filter(is_cheaper);
        rungs.rev().map(|n| name(LADDER[n])).collect()
    }

    /// Returns the names of what was chosen, from worst to best.
    fn climb(&self) -> Vec<String> {
        let mut chosen = Vec::new();
        let mut promises = BTreeMap::new();
        let mut rank = LADDER.len();
        for budget in self.budgets() {
            let Some(choice) = self.choose(budget) else {
                assert_eq!(rank, LADDER.len(), "{budget} bytes buy less than fewer do");
                continue;
            };
            let found = choice.plan.variant.description();
            assert!(choice.plan.bytes() <= budget, "{found}, {budget} bytes");
            assert_eq!(choice.plan.bytes(), self.needs[&found]);
            let now = LADDER
                .iter()
                .position(|&r| name(r) == found)
                .expect("a rung");
            assert!(
                now <= rank,
                "{found} with {budget} bytes is worse than before"
            );
            assert!(!choice.reason.is_empty() && !choice.next_better.is_empty());
            if now < rank {
                chosen.push(found);
            }
            rank = now;
            if let Some(bytes) = stated_bytes(&choice.next_better) {
                assert!(bytes > budget, "{}", choice.next_better);
                promises.insert(bytes, choice.next_better);
            }
        }
        for (bytes, promise) in promises {
            let better = self.choose(bytes).expect("a choice").plan;
            assert_eq!(better.bytes(), bytes, "{promise}");
            let worse = self.choose(bytes - 1).expect("a choice").plan;
            assert!(
                worse.variant.description() != better.variant.description(),
                "{promise}"
            );
        }
        crate::support::common::assert_silent(&self.device);
        chosen
    }
}

/// The first "(123 bytes)".
pub fn stated_bytes(text: &str) -> Option<u64> {
    let (before, _) = text.split_once(" bytes)")?;
    before.rsplit_once('(')?.1.parse().ok()
}

#[test]
fn a_growing_budget_climbs_every_rung() {
    let ladder = Ladder::new(nvidia_8(), dense(48, Kind::U16), scene());
    assert_eq!(ladder.climb(), ladder.worth_taking(0));
}

#[test]
fn so_does_a_scene_that_has_everything() {
    let mut scene = scene();
    with_everything(&mut scene);
    let ladder = Ladder::new(lavapipe(), sparse(64, Kind::F32), scene);
    assert_eq!(ladder.climb(), ladder.worth_taking(0));
}

#[test]
fn a_cpu_leaves_out_what_it_cannot_fill() {
    let ladder = Ladder::new(lavapipe(), dense(104, Kind::U8), scene());
    assert_eq!(ladder.climb(), ladder.worth_taking(2));
}
