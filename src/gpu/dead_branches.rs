//! Removes from a scene's shaders the branches that it never takes, where specialization constants decide them.
//!
//! Drivers remove them as well, but late: Mesa and SwiftShader first inline every function at each of its calls, and
//! tidy up afterwards. A path tracer is a few large functions with many calls, most of which a scene does not need,
//! and compiling code that was then thrown away took most of a start ("Starts" in `tools/measurements/files.md`).
//!
//! A selection whose condition is known becomes a jump. A block to which nothing jumps any more stays where it is,
//! but leads nowhere: drivers follow the jumps from the entry and never see it. Only where a loop would be left
//! without its continue target, that block still leads to the loop's head, as SPIR-V demands (2.11, "Structured
//! Control Flow"). A condition is known if it is a constant, one of the few operations of [`Walk::fold`] on known values,
//! or a phi of known values: `&&` and `||` are compiled to phis. Blocks are visited in the order in which the compiler
//! wrote them: jumps lead ahead, apart from those to the heads of loops. A module in any other order is left as it is.

use std::collections::{HashMap, HashSet};

use super::spirv::{HEADER_WORDS, Instruction, decoration, instructions, op, push};

/// The module without the branches that these values of its specialization constants, numbered 0, 1, …, decide.
pub(super) fn without_dead_branches(code: &[u32], constants: &[u32]) -> Result<Vec<u32>, String> {
    let all = instructions(code)?;
    let mut walk = Walk::new(constants);
    let mut kept = code[..HEADER_WORDS].to_vec();
    let mut rest = &all[..];
    while let [next, behind @ ..] = rest {
        rest = behind;
        if let Some(taken) = walk.decided(next, behind.first()) {
            walk.jump(taken);
            push(&mut kept, (op::BRANCH, &[taken]));
            rest = &behind[1..];
            continue;
        }
        match *next {
            (op::PHI, operands) => {
                let left = walk.left_of_phi(operands);
                walk.meet((op::PHI, &left));
                push(&mut kept, (op::PHI, &left));
            }
            (op::LOOP_MERGE | op::SELECTION_MERGE, _) if !walk.is_live => {}
            (opcode, _) if !walk.is_live && is_terminator(opcode) => match walk.head() {
                Some(head) => push(&mut kept, (op::BRANCH, &[head])),
                None => push(&mut kept, (op::UNREACHABLE, &[])),
            },
            other => {
                walk.meet(other);
                push(&mut kept, other);
            }
        }
    }
    Ok(if walk.is_in_order {
        kept
    } else {
        code.to_vec()
    })
}

/// Whether a block ends with this instruction.
fn is_terminator(opcode: u32) -> bool {
    matches!(
        opcode,
        op::BRANCH
            | op::BRANCH_CONDITIONAL
            | op::SWITCH
            | op::RETURN
            | op::RETURN_VALUE
            | op::UNREACHABLE
    )
}

/// What is known of a module before an instruction.
struct Walk<'a> {
    /// The specialization constants.
    constants: &'a [u32],
    /// The numbers of the specialization constants by id.
    numbers: HashMap<u32, u32>,
    /// Values by id; a truth value is 0 or 1.
    known: HashMap<u32, u32>,
    /// The current block.
    block: u32,
    /// Whether the current block can be reached; true before the first block.
    is_live: bool,
    /// Whether the next block is the first of a function, which calls reach.
    is_entry: bool,
    /// Blocks so far, and whether they are live.
    blocks: HashMap<u32, bool>,
    /// Blocks to which live blocks jump.
    targets: HashSet<u32>,
    /// Jumps of live blocks: from, to.
    jumps: HashSet<[u32; 2]>,
    /// The heads of live loops by their continue targets.
    heads: HashMap<u32, u32>,
    /// Blocks with phis.
    with_phis: HashSet<u32>,
    /// Whether blocks came in the order that is assumed: no jump has led back to a block that was taken for dead, and
    /// no loop's phi waits for one that is.
    is_in_order: bool,
}

impl Walk<'_> {
    fn new(constants: &[u32]) -> Walk<'_> {
        Walk {
            constants,
            numbers: HashMap::new(),
            known: HashMap::new(),
            block: 0,
            is_live: true,
            is_entry: false,
            blocks: HashMap::new(),
            targets: HashSet::new(),
            jumps: HashSet::new(),
            heads: HashMap::new(),
            with_phis: HashSet::new(),
            is_in_order: true,
        }
    }

    /// The block where a selection continues, if these two instructions decide it.
    fn decided(&self, next: &Instruction<'_>, behind: Option<&Instruction<'_>>) -> Option<u32> {
        match (next, behind) {
            (
                (op::SELECTION_MERGE, _),
                Some((op::BRANCH_CONDITIONAL, [condition, yes, no, ..])),
            ) if self.is_live && yes != no => Some(match self.known.get(condition)? {
                0 => *no,
                _ => *yes,
            }),
            _ => None,
        }
    }

    /// A phi's operands without those of blocks that no longer jump here.
    fn left_of_phi(&self, operands: &[u32]) -> Vec<u32> {
        let (result, pairs) = operands.split_at(operands.len().min(2));
        let mut left = result.to_vec();
        left.extend(pairs.chunks(2).filter(|pair| self.arrives(pair)).flatten());
        left
    }

    /// Whether the block that a phi's pair names jumps to the current block, or comes later and may do so.
    fn arrives(&self, pair: &[u32]) -> bool {
        matches!(pair, [_, from] if !self.blocks.contains_key(from) || self.jumps.contains(&[*from, self.block]))
    }

    /// The head of the live loop whose continue target is the current block, which is dead.
    fn head(&mut self) -> Option<u32> {
        let head = self.heads.get(&self.block).copied()?;
        self.is_in_order &= !self.with_phis.contains(&head);
        Some(head)
    }

    fn meet(&mut self, (opcode, operands): Instruction<'_>) {
        match (opcode, operands) {
            (op::DECORATE, [id, decoration::SPEC_ID, number]) => {
                self.numbers.insert(*id, *number);
            }
            (op::FUNCTION, _) => self.is_entry = true,
            (op::LABEL, [block]) => {
                self.block = *block;
                self.is_live = std::mem::take(&mut self.is_entry) || self.targets.contains(block);
                self.blocks.insert(*block, self.is_live);
            }
            _ if !self.is_live => {}
            (op::LOOP_MERGE, [_, continues, ..]) => {
                self.heads.insert(*continues, self.block);
            }
            (op::BRANCH, [to]) => self.jump(*to),
            (op::BRANCH_CONDITIONAL, [_, yes, no, ..]) => {
                self.jump(*yes);
                self.jump(*no);
            }
            (op::SWITCH, [_, targets @ ..]) => {
                // The default, then pairs of a value and a target.
                targets.iter().step_by(2).for_each(|to| self.jump(*to));
            }
            (_, [_, id, rest @ ..]) => {
                if opcode == op::PHI {
                    self.with_phis.insert(self.block);
                }
                if let Some(value) = self.value(opcode, *id, rest) {
                    self.known.insert(*id, value);
                }
            }
            _ => {}
        }
    }

    fn jump(&mut self, to: u32) {
        self.targets.insert(to);
        self.jumps.insert([self.block, to]);
        self.is_in_order &= self.blocks.get(&to) != Some(&false);
    }

    /// The value that an instruction gives to an id.
    fn value(&self, opcode: u32, id: u32, operands: &[u32]) -> Option<u32> {
        let number = self.numbers.get(&id);
        let constant = number.and_then(|&number| self.constants.get(number as usize));
        let truth = |default: bool| constant.map_or(default, |&value| value != 0) as u32;
        match (opcode, operands) {
            (op::CONSTANT_TRUE, []) => Some(1),
            (op::CONSTANT_FALSE, []) => Some(0),
            (op::SPEC_CONSTANT_TRUE, []) => Some(truth(true)),
            (op::SPEC_CONSTANT_FALSE, []) => Some(truth(false)),
            (op::CONSTANT, [word]) => Some(*word),
            (op::SPEC_CONSTANT, [word]) => Some(constant.copied().unwrap_or(*word)),
            (op::SPEC_CONSTANT_OP, [opcode, operands @ ..]) => self.fold(*opcode, operands),
            (op::PHI, pairs) => self.phi(pairs),
            _ => self.fold(opcode, operands),
        }
    }

    fn fold(&self, opcode: u32, operands: &[u32]) -> Option<u32> {
        let known = |id: &u32| self.known.get(id).copied();
        let value = match (opcode, operands) {
            (op::LOGICAL_NOT, [a]) => known(a)? == 0,
            (op::LOGICAL_AND, [a, b]) => match (known(a), known(b)) {
                (Some(0), _) | (_, Some(0)) => false,
                (a, b) => a.and(b)? != 0,
            },
            (op::LOGICAL_OR, [a, b]) => match (known(a), known(b)) {
                (Some(1), _) | (_, Some(1)) => true,
                (a, b) => a.and(b)? != 0,
            },
            (op::I_EQUAL, [a, b]) => known(a)? == known(b)?,
            (op::I_NOT_EQUAL, [a, b]) => known(a)? != known(b)?,
            (op::U_GREATER_THAN, [a, b]) => known(a)? > known(b)?,
            _ => return None,
        };
        Some(value as u32)
    }

    /// The one value that comes from all live blocks. Whether later blocks are live is not known yet.
    fn phi(&self, pairs: &[u32]) -> Option<u32> {
        let mut found = None;
        for pair in pairs.chunks(2) {
            let [id, from] = pair else { return None };
            if !*self.blocks.get(from)? {
                continue;
            }
            let value = *self.known.get(id)?;
            if *found.get_or_insert(value) != value {
                return None;
            }
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::{PassDesc, Shaders};

    /// As the compiler of shaders writes it.
    fn compiled(text: &str) -> Vec<u32> {
        let head = "#version 460
            layout(local_size_x = 1) in;
            layout(constant_id = 0) const bool has_a = true;
            layout(constant_id = 1) const uint count_b = 1;
            buffer Numbers { uint numbers[]; };
            uint deep(uint n) { return n > 9u ? n : n + 1u; }\n";
        let text = [head, text].concat();
        let desc = PassDesc {
            name: "branches",
            specialization: &[],
            push: "",
            macros: &[],
        };
        let shaders = Shaders::new(String::new()).with_file("branches.comp", &text);
        shaders.compile(&desc, &[]).expect("SPIR-V")
    }

    /// Selections in live blocks of `main`, before and after.
    fn selections(body: &str, constants: &[u32]) -> [usize; 2] {
        let code = compiled(&format!("void main() {{ {body} }}"));
        let kept = without_dead_branches(&code, constants).expect("SPIR-V");
        [&code, &kept].map(|code| live_selections(code))
    }

    fn live_selections(code: &[u32]) -> usize {
        let all = instructions(code).expect("SPIR-V");
        let mut walk = Walk::new(&[]);
        // With no constant known, blocks are live that any jump leads to.
        let mut count = 0;
        for instruction in all.iter().filter(|(opcode, _)| *opcode >= op::FUNCTION) {
            walk.meet(*instruction);
            count += (walk.is_live && instruction.0 == op::SELECTION_MERGE) as usize;
        }
        // One is that of `deep`.
        count - 1
    }

    #[test]
    fn what_constants_decide_is_gone_and_nothing_else() {
        let body = "if (has_a) { numbers[0] = deep(1u); } else { numbers[1] = deep(2u); }";
        assert_eq!(selections(body, &[1, 1]), [1, 0]);
        assert_eq!(selections(body, &[0, 1]), [1, 0]);
        let body = "if (numbers[3] == 3u) { numbers[0] = deep(1u); }";
        assert_eq!(selections(body, &[0, 1]), [1, 1]);
        let body = "if (count_b > 1u) { if (numbers[3] == 3u) numbers[0] = deep(1u); }";
        assert_eq!(selections(body, &[1, 2]), [2, 1]);
        assert_eq!(selections(body, &[1, 1]), [2, 0]);
    }

    /// `&&` is a selection and a phi, and so is what hangs on it.
    #[test]
    fn what_follows_from_constants_is_known_as_well() {
        let body = "if (has_a && deep(numbers[0]) == 3u) { numbers[1] = deep(2u); }";
        assert_eq!(selections(body, &[0, 1]), [2, 0]);
        assert_eq!(selections(body, &[1, 1]), [2, 1]);
        let body = "if (!has_a || deep(numbers[0]) == 3u) { numbers[1] = deep(2u); }";
        assert_eq!(selections(body, &[0, 1]), [2, 0]);
        let body = "if (has_a && count_b == 2u) { numbers[1] = deep(2u); }";
        assert_eq!(selections(body, &[1, 2]), [1, 0]);
        assert_eq!(selections(body, &[1, 3]), [1, 0]);
    }

    /// A jump back to a block that was taken for dead.
    #[test]
    fn a_module_in_another_order_is_left_as_it_is() {
        let mut code = vec![super::super::spirv::MAGIC, 0, 0, 9, 0];
        let all: [Instruction<'_>; 12] = [
            (op::CONSTANT_TRUE, &[1, 2]),
            (op::FUNCTION, &[]),
            (op::LABEL, &[3]),
            (op::SELECTION_MERGE, &[6, 0]),
            (op::BRANCH_CONDITIONAL, &[2, 5, 4]),
            (op::LABEL, &[4]),
            (op::BRANCH, &[6]),
            (op::LABEL, &[5]),
            (op::BRANCH, &[4]),
            (op::LABEL, &[6]),
            (op::PHI, &[1, 7, 2, 4]),
            (op::BRANCH, &[6]),
        ];
        for instruction in all {
            push(&mut code, instruction);
        }
        assert_eq!(without_dead_branches(&code, &[]), Ok(code));
    }
}
