//! Arithmetic of directions and positions in the patient.

pub type Vector = [f64; 3];

pub fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub fn cross(a: Vector, b: Vector) -> Vector {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

pub fn scaled(a: Vector, factor: f64) -> Vector {
    a.map(|x| factor * x)
}

/// The point at `length` from `from` along `direction`.
pub fn moved(from: Vector, direction: Vector, length: f64) -> Vector {
    std::array::from_fn(|a| from[a] + length * direction[a])
}

pub fn difference(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|axis| a[axis] - b[axis])
}

/// The direction of a vector, if it has one.
pub fn unit(a: Vector) -> Option<Vector> {
    let length = dot(a, a).sqrt();
    (length.is_finite() && length > 1e-6).then(|| scaled(a, 1.0 / length))
}
