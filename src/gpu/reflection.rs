//! The interface of a compute shader, read from its SPIR-V: resources by name, push constants, workgroup size.
//!
//! Only what the shaders of this program contain is understood, and anything else is an error: storage buffers,
//! storage images and sampled images in descriptor set 0, and push constants made of 32-bit scalars, vectors and
//! structs.

use std::collections::HashMap;

use ash::vk;

use super::spirv::{HEADER_WORDS, Instruction, decoration, instructions, op};

/// A resource that the shader uses.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Resource {
    pub name: String,
    pub binding: u32,
    pub kind: vk::DescriptorType,
    /// Whether it is a storage image that the shader may write.
    pub is_written: bool,
}

#[derive(Debug, PartialEq, Eq)]
pub(super) struct Reflection {
    /// The resources, in the order in which the module declares them.
    pub resources: Vec<Resource>,
    pub push_bytes: u32,
    /// Threads of a workgroup along x, y and z.
    pub workgroup: [u32; 3],
}

impl Reflection {
    /// Reads the module that the shader compiler returned. The error says what is not understood.
    pub fn read(code: &[u32]) -> Result<Reflection, String> {
        let module = Module::read(code)?;
        let mut resources = Vec::new();
        let mut push_bytes = 0;
        for variable in module.variables() {
            let Variable { id, pointer, class } = variable?;
            if is_resource(class) {
                resources.push(module.resource(id, module.pointee(pointer)?, class)?);
            } else if class == storage::PUSH_CONSTANT {
                push_bytes = module.bytes(module.pointee(pointer)?)?;
            }
        }
        Ok(Reflection {
            resources,
            push_bytes,
            workgroup: module.workgroup()?,
        })
    }
}

/// Gives resources the binding numbers 0, 1, … in the order in which the module declares them. GLSL does not state
/// any, since passes bind by name. The compiler numbers only the resources that `main` reaches and leaves the others
/// at 0, but the layout of a pass's descriptors holds everything that its shader declares.
pub(super) fn number_resources(code: &mut [u32]) -> Result<(), String> {
    let variables: Vec<Variable> = Module::read(code)?.variables().collect::<Result<_, _>>()?;
    let resources = variables.iter().filter(|v| is_resource(v.class));
    let numbers: HashMap<u32, u32> = resources.map(|v| v.id).zip(0..).collect();
    let mut rest = &mut code[HEADER_WORDS..];
    while let Some(&first) = rest.first() {
        let (instruction, behind) = rest.split_at_mut((first >> 16) as usize);
        if let [_, id, decoration::BINDING, binding] = instruction
            && first & 0xffff == op::DECORATE
            && let Some(&number) = numbers.get(id)
        {
            *binding = number;
        }
        rest = behind;
    }
    Ok(())
}

/// A variable with a place in memory: its id, the type of a pointer to it, and its storage class.
struct Variable {
    id: u32,
    pointer: u32,
    class: u32,
}

/// Whether variables of this storage class are bound: buffers and images.
fn is_resource(class: u32) -> bool {
    matches!(
        class,
        storage::UNIFORM_CONSTANT | storage::UNIFORM | storage::STORAGE_BUFFER
    )
}

/// Storage classes.
mod storage {
    pub const UNIFORM_CONSTANT: u32 = 0;
    pub const UNIFORM: u32 = 2;
    pub const PUSH_CONSTANT: u32 = 9;
    pub const STORAGE_BUFFER: u32 = 12;
}

const MODE_LOCAL_SIZE: u32 = 17;
/// OpTypeImage's operand for images that are used without a sampler.
const IMAGE_IS_STORAGE: u32 = 2;
/// OpTypeImage's operand for storage images whose format the shader does not state.
const NO_FORMAT: u32 = 0;

/// Instructions as opcode and operands.
struct Module<'a>(Vec<Instruction<'a>>);

impl<'a> Module<'a> {
    fn read(code: &'a [u32]) -> Result<Module<'a>, String> {
        instructions(code).map(Module)
    }

    /// The operands of all instructions with this opcode.
    fn all(&self, opcode: u32) -> impl Iterator<Item = &'a [u32]> {
        let found = self.0.iter().filter(move |(op, _)| *op == opcode);
        found.map(|(_, operands)| *operands)
    }

    /// All variables, in the order in which the module declares them.
    fn variables(&self) -> impl Iterator<Item = Result<Variable, String>> {
        self.all(op::VARIABLE).map(|operands| match *operands {
            [pointer, id, class, ..] => Ok(Variable { id, pointer, class }),
            _ => Err("a variable without a storage class".into()),
        })
    }

    /// The opcode and the operands of a type's declaration, without its id.
    fn declaration(&self, id: u32) -> Result<(u32, &'a [u32]), String> {
        let is_type = |op: u32| (op::TYPE_INT..=op::TYPE_POINTER).contains(&op);
        let found = self.0.iter().find_map(|(op, operands)| match operands {
            [of, rest @ ..] if is_type(*op) && *of == id => Some((*op, rest)),
            _ => None,
        });
        found.ok_or_else(|| format!("type {id} is not understood"))
    }

    fn pointee(&self, id: u32) -> Result<u32, String> {
        match self.declaration(id)? {
            (op::TYPE_POINTER, [_, pointee]) => Ok(*pointee),
            _ => Err(format!("type {id} is no pointer")),
        }
    }

    fn decoration(&self, id: u32, wanted: u32) -> Option<u32> {
        self.all(op::DECORATE).find_map(|operands| match *operands {
            [of, decoration, value] if of == id && decoration == wanted => Some(value),
            _ => None,
        })
    }

    fn is_readonly(&self, id: u32) -> bool {
        self.all(op::DECORATE)
            .any(|operands| *operands == [id, decoration::NON_WRITABLE])
    }

    fn name(&self, id: u32) -> Option<String> {
        let mut names = self.all(op::NAME);
        let words = names.find_map(|operands| operands.strip_prefix(&[id]))?;
        let bytes = words.iter().flat_map(|word| word.to_le_bytes());
        String::from_utf8(bytes.take_while(|byte| *byte != 0).collect()).ok()
    }

    fn resource(&self, id: u32, kind: u32, class: u32) -> Result<Resource, String> {
        let name = self
            .name(id)
            .ok_or_else(|| format!("variable {id} has no name"))?;
        if self.decoration(id, decoration::DESCRIPTOR_SET) != Some(0) {
            return Err(format!("{name}: only descriptor set 0 is used"));
        }
        let kind = match (class, self.declaration(kind)?) {
            (storage::STORAGE_BUFFER, (op::TYPE_STRUCT, _)) => vk::DescriptorType::STORAGE_BUFFER,
            (_, (op::TYPE_SAMPLED_IMAGE, _)) => vk::DescriptorType::COMBINED_IMAGE_SAMPLER,
            (_, (op::TYPE_IMAGE, [_, _, _, _, _, IMAGE_IS_STORAGE, NO_FORMAT, ..])) => {
                return Err(format!(
                    "{name} is a storage image without a format, which devices need not read or write"
                ));
            }
            (_, (op::TYPE_IMAGE, [_, _, _, _, _, IMAGE_IS_STORAGE, ..])) => {
                vk::DescriptorType::STORAGE_IMAGE
            }
            _ => {
                return Err(format!(
                    "{name} is no buffer and no image that a pass binds"
                ));
            }
        };
        let binding = self.decoration(id, decoration::BINDING);
        Ok(Resource {
            binding: binding.ok_or_else(|| format!("{name} has no binding"))?,
            name,
            is_written: kind == vk::DescriptorType::STORAGE_IMAGE && !self.is_readonly(id),
            kind,
        })
    }

    /// Bytes from the start of a push constant to its end. Types are declared after their components, so one walk
    /// finds all sizes, and a type that claims to hold itself has none.
    fn bytes(&self, id: u32) -> Result<u32, String> {
        let offsets = self.offsets();
        let mut sizes: HashMap<u32, u32> = HashMap::new();
        for (op, operands) in &self.0 {
            let size = match (*op, *operands) {
                (op::TYPE_INT | op::TYPE_FLOAT, [_, bits, ..]) => Some(bits / 8),
                (op::TYPE_VECTOR, [_, component, count]) => {
                    let size = sizes.get(component);
                    size.and_then(|size| size.checked_mul(*count))
                }
                (op::TYPE_STRUCT, [id, members @ ..]) => {
                    members
                        .iter()
                        .zip(0..)
                        .try_fold(0, |end: u32, (member, i)| {
                            let offset = offsets.get(&(*id, i))?;
                            Some(end.max(offset.checked_add(*sizes.get(member)?)?))
                        })
                }
                _ => None,
            };
            if let (Some(size), Some(id)) = (size, operands.first()) {
                sizes.insert(*id, size);
            }
        }
        let size = sizes.get(&id).copied();
        size.ok_or_else(|| format!("push constants hold a type {id} that is not understood"))
    }

    /// Offsets of the members of structs, by the struct and the member's number.
    fn offsets(&self) -> HashMap<(u32, u32), u32> {
        let all = self.all(op::MEMBER_DECORATE);
        let offsets = all.filter_map(|operands| match *operands {
            [of, member, decoration::OFFSET, value] => Some(((of, member), value)),
            _ => None,
        });
        offsets.collect()
    }

    fn workgroup(&self) -> Result<[u32; 3], String> {
        let mut modes = self.all(op::EXECUTION_MODE);
        let size = modes.find_map(|operands| match *operands {
            [_, MODE_LOCAL_SIZE, x, y, z] => Some([x, y, z]),
            _ => None,
        });
        size.ok_or_else(|| "the shader states no local size".into())
    }
}

#[cfg(test)]
mod tests {
    use super::super::spirv::{MAGIC, push};
    use super::*;
    use crate::gpu::{PassDesc, Shaders};

    const SHADER: &str = "#version 460
        #extension GL_EXT_scalar_block_layout : require
        layout(local_size_x = 4, local_size_y = 2) in;
        layout(push_constant, scalar) uniform PushBlock { vec3 a; uint b; } push;
        layout(scalar) readonly buffer FromBlock { uint at; } from;
        uniform sampler2D picture;
        layout(r32f) uniform image3D cells;
        layout(r32f) readonly uniform image3D values;
        layout(scalar) writeonly buffer ToBlock { uint at; } to;
        float unused() { return texture(picture, vec2(0.0)).r + imageLoad(cells, ivec3(0)).r
            + imageLoad(values, ivec3(0)).r; }
        void main() { to.at = from.at + push.b; }";

    fn compiled(glsl: &str) -> Vec<u32> {
        let shaders = Shaders::new(String::new());
        let desc = PassDesc {
            name: "declares",
            specialization: &[],
            push: "",
            macros: &[],
        };
        let shaders = shaders.with_file("declares.comp", glsl);
        let mut code = shaders.compile(&desc, &[]).expect("SPIR-V");
        number_resources(&mut code).expect("SPIR-V");
        code
    }

    #[test]
    fn a_storage_image_states_its_format() {
        let format = "layout(r32f) uniform image3D cells";
        let without = SHADER.replace(format, "writeonly uniform image3D cells");
        let without = without.replace(" + imageLoad(cells, ivec3(0)).r", "");
        let error = Reflection::read(&compiled(&without)).expect_err("no format");
        assert!(
            error.contains("cells is a storage image without"),
            "{error}"
        );
    }

    #[test]
    fn resources_are_numbered_whether_they_are_used_or_not() {
        let code = compiled(SHADER);
        let Reflection {
            resources,
            push_bytes,
            workgroup,
        } = Reflection::read(&code).expect("SPIR-V");
        assert!(resources.iter().map(|resource| resource.binding).eq(0..5));
        let mut kinds: Vec<_> = resources
            .iter()
            .map(|s| (s.name.as_str(), s.kind, s.is_written))
            .collect();
        kinds.sort();
        let expected = [
            ("cells", vk::DescriptorType::STORAGE_IMAGE, true),
            ("from", vk::DescriptorType::STORAGE_BUFFER, false),
            ("picture", vk::DescriptorType::COMBINED_IMAGE_SAMPLER, false),
            ("to", vk::DescriptorType::STORAGE_BUFFER, false),
            ("values", vk::DescriptorType::STORAGE_IMAGE, false),
        ];
        assert_eq!(kinds, expected);
        assert_eq!((push_bytes, workgroup), (16, [4, 2, 1]));
    }

    /// A module whose push constants have type 1.
    fn pushes(declarations: &[&[u32]]) -> Result<Reflection, String> {
        let mut code = vec![MAGIC, 0, 0, 9, 0];
        let pointer = [op::TYPE_POINTER, 2, storage::PUSH_CONSTANT, 1];
        let variable = [op::VARIABLE, 2, 3, storage::PUSH_CONSTANT];
        let mode = [op::EXECUTION_MODE, 4, MODE_LOCAL_SIZE, 1, 1, 1];
        let last: [&[u32]; 3] = [&pointer, &variable, &mode];
        for instruction in declarations.iter().chain(&last) {
            push(&mut code, (instruction[0], &instruction[1..]));
        }
        Reflection::read(&code)
    }

    #[test]
    fn types_without_a_size_are_not_understood() {
        let word: &[u32] = &[op::TYPE_INT, 5, 32, 0];
        let bytes = |all: &[&[u32]]| pushes(all).map(|reflection| reflection.push_bytes);
        let at = |offset| [op::MEMBER_DECORATE, 1, 0, decoration::OFFSET, offset];
        let holds = |member| [op::TYPE_STRUCT, 1, member];
        assert_eq!(bytes(&[&at(8), word, &holds(5)]), Ok(12));
        assert!(bytes(&[&at(0), word, &holds(1)]).is_err(), "itself");
        assert!(bytes(&[&at(u32::MAX), word, &holds(5)]).is_err(), "no end");
        let many: &[u32] = &[op::TYPE_VECTOR, 1, 5, u32::MAX];
        assert!(bytes(&[word, many]).is_err(), "no end");
    }
}
