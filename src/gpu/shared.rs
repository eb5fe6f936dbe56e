//! One definition of all data that CPU and GPU share: the Rust struct. The macros emit its GLSL text, and scalar
//! block layout makes the bytes agree: every member is a multiple of four bytes.

/// GLSL's names for the types that shared structs are made of.
#[allow(non_camel_case_types)]
pub mod types {
    pub type float = f32;
    pub type uint = u32;
    pub type int = i32;
    pub type vec2 = [f32; 2];
    pub type vec3 = [f32; 3];
    pub type vec4 = [f32; 4];
    pub type ivec3 = [i32; 3];
    pub type uvec2 = [u32; 2];
    pub type uvec3 = [u32; 3];
    pub type mat3 = [[f32; 3]; 3];
}

/// A struct with a GLSL twin.
pub trait Shared: bytemuck::Pod {
    /// `struct Name { … };`
    const GLSL: &'static str;
    /// A block of push constants with the same members, called `push`: the text of `#include "push.glsl"` in the
    /// shader of a pass that takes them.
    const PUSH: &'static str;
}

/// The push constants of a pass that has none.
impl Shared for () {
    const GLSL: &'static str = "";
    const PUSH: &'static str = "";
}

/// A struct of specialization constants, for which a shader is compiled.
pub trait Specialization {
    /// `layout(constant_id = …) const …;` for each field, in order.
    fn glsl() -> String;
    /// The values, in the same order.
    fn words(&self) -> Vec<u32>;
}

/// A specialization constant as Vulkan takes it.
pub trait Word {
    fn word(self) -> u32;
}

impl Word for bool {
    fn word(self) -> u32 {
        self as u32
    }
}

impl Word for u32 {
    fn word(self) -> u32 {
        self
    }
}

/// Defines `#[repr(C)]` structs and their GLSL, and after `all NAME:` a constant with the GLSL of all of them.
#[macro_export]
macro_rules! shared {
    (all $all:ident: $($(#[$about:meta])* pub struct $name:ident $fields:tt)*) => {
        /// The GLSL of all structs here, one by one.
        const $all: &[&str] = &[$(<$name as $crate::gpu::Shared>::GLSL,)*];
        $crate::shared! { $($(#[$about])* pub struct $name $fields)* }
    };
    ($($(#[$about:meta])* pub struct $name:ident {
        $($(#[$note:meta])* pub $field:ident: $kind:ident,)*
    })*) => {$(
        $(#[$about])*
        #[repr(C)]
        #[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
        pub struct $name {
            $($(#[$note])* pub $field: $kind,)*
        }

        impl $crate::gpu::Shared for $name {
            const GLSL: &'static str = concat!(
                "struct ", stringify!($name), " {\n",
                $("    ", stringify!($kind), " ", stringify!($field), ";\n",)*
                "};\n"
            );
            const PUSH: &'static str = concat!(
                "layout(push_constant, scalar) uniform ", stringify!($name), "Block {\n",
                $("    ", stringify!($kind), " ", stringify!($field), ";\n",)*
                "} push;\n"
            );
        }
    )*};
}

/// Defines a struct of specialization constants.
#[macro_export]
macro_rules! specialization {
    ($(#[$about:meta])* pub struct $name:ident {
        $($(#[$note:meta])* pub $field:ident: $kind:ident,)*
    }) => {
        $(#[$about])*
        #[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
        pub struct $name {
            $($(#[$note])* pub $field: $kind,)*
        }

        impl $crate::gpu::Specialization for $name {
            fn glsl() -> String {
                [$((stringify!($kind), stringify!($field)),)*]
                    .iter()
                    .enumerate()
                    .map(|(id, (kind, name))| {
                        format!("layout(constant_id = {id}) const {kind} {name} = {kind}(1);\n")
                    })
                    .collect()
            }

            fn words(&self) -> Vec<u32> {
                vec![$($crate::gpu::Word::word(self.$field),)*]
            }
        }
    };
}
