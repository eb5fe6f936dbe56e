//! Branches that specialization constants decide are taken out of a shader before the driver sees it. What is left has to
//! do the same as the whole text, in which nothing is decided before it runs.

use std::sync::Arc;

use isolume::gpu::*;

use crate::support::common::*;

const INPUTS: u32 = 64;

/// Selections of every kind that the compiler makes of GLSL: within each other, in loops and in switches, with calls, with
/// returns, and in conditions of several parts.
const BODY: &str = "
    uint g(uint n) { if (A) { return n * 7u + 3u; } if (B == 2u) { n += 5u; } return n ^ 21u; }
    uint h(uint n) {
        uint sum = 0u;
        for (uint i = 0u; i < B + 2u; i++) {
            if (A && g(i) > n) { break; }
            if (!A && C) { sum += 1u; continue; }
            sum += C ? g(i + n) : i;
        }
        for (uint i = 0u; i < n; i++) { sum += i; if (C) { break; } if (A) { return sum; } sum ^= g(i); }
        while (true) { if (sum < 99u || B == 1u) { break; } sum /= 3u; }
        return sum;
    }
    uint f(uint n) {
        uint x = n;
        if (A && B > 1u && h(n) > 9u) { x += h(n + 1u); }
        if (C || g(n) == 4u) { x ^= 1024u; } else { x += g(x); }
        bool any = A || B == 0u;
        if (any && !(C && n > 30u)) { if (n % 3u == 0u) { x += h(x); } else if (A) { x += 17u; } }
        switch (B) { case 0u: x += 1u; break; case 1u: if (C) { x += 2u; break; } x += 3u; default: x += g(n); }
        bool both = A && C;
        bool either = n > 5u ? both : A;
        return either ? x * 3u : x;
    }
    void main() {
        uint n = gl_GlobalInvocationID.x;
        results.of[n] = f(n);
    }";

/// The results of all inputs.
fn run(device: &Arc<Device>, values: &str, constants: &[u32]) -> Vec<u32> {
    let head = "#version 460
        #extension GL_EXT_scalar_block_layout : require
        layout(local_size_x = 64) in;
        layout(scalar) readonly buffer GivenBlock { uint of[]; } given;
        layout(scalar) writeonly buffer ResultsBlock { uint of[]; } results;\n";
    let shaders =
        Shaders::new(String::new()).with_file("decided.comp", &[head, values, BODY].concat());
    let desc = PassDesc {
        name: "decided",
        specialization: constants,
        push: "",
        macros: &[],
    };
    let pass = Pass::new(device, &shaders, &desc).expect("a pass");
    let memory = Memory::new(device, 1 << 20).expect("memory");
    let given = Buffer::with_data(&memory, "given", constants).expect("a buffer");
    let desc = BufferDesc::host_cached("results", 4 * u64::from(INPUTS));
    let results = Buffer::new(&memory, desc).expect("a buffer");
    let bindings = [
        ("given", Binding::Buffer(&given)),
        ("results", Binding::Buffer(&results)),
    ];
    let mut frame = Frame::new(device).expect("a frame");
    frame
        .run(|recording| recording.dispatch(&pass, &bindings, &(), [INPUTS, 1, 1]))
        .expect("a run");
    results.read_vec(INPUTS as usize)
}

#[test]
fn a_shader_does_the_same_without_them() {
    let decided = "layout(constant_id = 0) const bool A = true;
        layout(constant_id = 1) const uint B = 1;
        layout(constant_id = 2) const bool C = true;\n";
    let undecided =
        "#define A (given.of[0] != 0u)\n#define B given.of[1]\n#define C (given.of[2] != 0u)\n";
    let device = device();
    for case in 0..16 {
        let constants = [case & 1, case >> 1 & 3, case >> 3];
        assert_eq!(
            run(&device, decided, &constants),
            run(&device, undecided, &constants),
            "{constants:?}"
        );
    }
    assert_silent(&device);
}
