//! SPIR-V as instructions, with the opcodes and decorations that this program understands. A library that models all of
//! SPIR-V would be among the dependencies that take longest to compile, and only two dozen kinds of instruction are
//! needed.

pub(super) const MAGIC: u32 = 0x0723_0203;
pub(super) const HEADER_WORDS: usize = 5;

/// Opcodes, from section 3.42 of the SPIR-V specification.
pub(super) mod op {
    pub const NAME: u32 = 5;
    pub const EXECUTION_MODE: u32 = 16;
    pub const TYPE_INT: u32 = 21;
    pub const TYPE_FLOAT: u32 = 22;
    pub const TYPE_VECTOR: u32 = 23;
    pub const TYPE_IMAGE: u32 = 25;
    pub const TYPE_SAMPLED_IMAGE: u32 = 27;
    pub const TYPE_STRUCT: u32 = 30;
    pub const TYPE_POINTER: u32 = 32;
    pub const CONSTANT_TRUE: u32 = 41;
    pub const CONSTANT_FALSE: u32 = 42;
    pub const CONSTANT: u32 = 43;
    pub const SPEC_CONSTANT_TRUE: u32 = 48;
    pub const SPEC_CONSTANT_FALSE: u32 = 49;
    pub const SPEC_CONSTANT: u32 = 50;
    pub const SPEC_CONSTANT_OP: u32 = 52;
    pub const FUNCTION: u32 = 54;
    pub const VARIABLE: u32 = 59;
    pub const DECORATE: u32 = 71;
    pub const MEMBER_DECORATE: u32 = 72;
    pub const LOGICAL_OR: u32 = 166;
    pub const LOGICAL_AND: u32 = 167;
    pub const LOGICAL_NOT: u32 = 168;
    pub const I_EQUAL: u32 = 170;
    pub const I_NOT_EQUAL: u32 = 171;
    pub const U_GREATER_THAN: u32 = 172;
    pub const PHI: u32 = 245;
    pub const LOOP_MERGE: u32 = 246;
    pub const SELECTION_MERGE: u32 = 247;
    pub const LABEL: u32 = 248;
    pub const BRANCH: u32 = 249;
    pub const BRANCH_CONDITIONAL: u32 = 250;
    pub const SWITCH: u32 = 251;
    pub const RETURN: u32 = 253;
    pub const RETURN_VALUE: u32 = 254;
    pub const UNREACHABLE: u32 = 255;
}

/// Decorations.
pub(super) mod decoration {
    pub const SPEC_ID: u32 = 1;
    pub const NON_WRITABLE: u32 = 24;
    pub const BINDING: u32 = 33;
    pub const DESCRIPTOR_SET: u32 = 34;
    pub const OFFSET: u32 = 35;
}

/// The opcode of an instruction, and its operands.
pub(super) type Instruction<'a> = (u32, &'a [u32]);

/// The module's instructions in their order.
pub(super) fn instructions(code: &[u32]) -> Result<Vec<Instruction<'_>>, String> {
    if code.first() != Some(&MAGIC) || code.len() < HEADER_WORDS {
        return Err("this is not SPIR-V".into());
    }
    let mut rest = &code[HEADER_WORDS..];
    let mut instructions = Vec::new();
    while let Some(&first) = rest.first() {
        let words = (first >> 16) as usize;
        let Some(instruction @ [_, operands @ ..]) = rest.get(..words) else {
            return Err(format!("an instruction of {words} words"));
        };
        instructions.push((first & 0xffff, operands));
        rest = &rest[instruction.len()..];
    }
    Ok(instructions)
}

/// Adds an instruction to a module.
pub(super) fn push(code: &mut Vec<u32>, (opcode, operands): Instruction<'_>) {
    code.push((operands.len() as u32 + 1) << 16 | opcode);
    code.extend(operands);
}
