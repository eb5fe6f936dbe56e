//! How surfaces reflect: Lambert, Phong, and Burley's "Physically-based shading at Disney" (2012).
//!
//! Directions are unit vectors that point away from the surface; only those with n·ω > 0 count.

use super::random::Random;
use glam::DVec3;
use isolume::scene::{Disney, Isosurface, Shading};
use std::f64::consts::PI;

/// The BRDF itself, without the cosine.
pub fn evaluate(iso: &Isosurface, n: DVec3, outgoing: DVec3, incoming: DVec3) -> DVec3 {
    let color = DVec3::from(iso.color);
    if n.dot(outgoing) <= 0.0 || n.dot(incoming) <= 0.0 {
        return DVec3::ZERO;
    }
    match iso.shading {
        Shading::Lambert => color / PI,
        Shading::Phong {
            specular,
            shininess,
        } => {
            let lobe = (shininess + 2.0) / (2.0 * PI) * power(n, outgoing, incoming, shininess);
            (1.0 - specular) * color / PI + DVec3::splat(specular * lobe)
        }
        Shading::Disney(parameters) => disney(parameters, color, n, outgoing, incoming),
    }
}

/// max(0, cos α)^k, which is 0 behind the lobe for k = 0, too.
fn power(n: DVec3, outgoing: DVec3, incoming: DVec3, k: f64) -> f64 {
    let cosine = mirror(n, outgoing).dot(incoming);
    if cosine > 0.0 { cosine.powf(k) } else { 0.0 }
}

/// Names and order of the terms as in Burley's own implementation, the BRDF explorer's disney.brdf.
fn disney(parameters: Disney, color: DVec3, n: DVec3, outgoing: DVec3, incoming: DVec3) -> DVec3 {
    let Disney {
        metallic,
        roughness,
        specular,
        specular_tint,
        sheen,
        sheen_tint,
        subsurface,
        clearcoat,
        clearcoat_gloss,
    } = parameters;
    let half = (incoming + outgoing).normalize();
    let (n_l, n_v) = (n.dot(incoming), n.dot(outgoing));
    let (n_h, l_h) = (n.dot(half), incoming.dot(half));

    let luminance = color.dot(DVec3::new(0.3, 0.6, 0.1));
    let tint = if luminance > 0.0 {
        color / luminance
    } else {
        DVec3::ONE
    };
    let dielectric = 0.08 * specular * DVec3::ONE.lerp(tint, specular_tint);
    let f0 = dielectric.lerp(color, metallic);
    let sheen_color = DVec3::ONE.lerp(tint, sheen_tint);
    let (fresnel_l, fresnel_v, fresnel_h) = (schlick(n_l), schlick(n_v), schlick(l_h));

    let retro = |f90: f64| mix(1.0, f90, fresnel_l) * mix(1.0, f90, fresnel_v);
    let diffuse = retro(0.5 + 2.0 * l_h * l_h * roughness);
    let flat = retro(l_h * l_h * roughness);
    let flat = 1.25 * (flat * (1.0 / (n_l + n_v) - 0.5) + 0.5);
    let base = mix(diffuse, flat, subsurface) / PI * color;
    let sheen = fresnel_h * sheen * sheen_color;

    let alpha = specular_alpha(roughness);
    let specular = gtr2(n_h, alpha) * smith(n_l, alpha) * smith(n_v, alpha);
    let coat = gtr1(n_h, clearcoat_alpha(clearcoat_gloss)) * smith(n_l, 0.25) * smith(n_v, 0.25);

    (1.0 - metallic) * (base + sheen)
        + specular * f0.lerp(DVec3::ONE, fresnel_h)
        + DVec3::splat(0.25 * clearcoat * coat * mix(0.04, 1.0, fresnel_h))
}

fn mix(a: f64, b: f64, t: f64) -> f64 {
    a + t * (b - a)
}

fn schlick(cosine: f64) -> f64 {
    (1.0 - cosine).clamp(0.0, 1.0).powi(5)
}

pub fn specular_alpha(roughness: f64) -> f64 {
    (roughness * roughness).max(1e-3)
}

pub fn clearcoat_alpha(gloss: f64) -> f64 {
    mix(0.1, 0.001, gloss)
}

/// Berry's distribution: D with ∫ D cos = 1 over the hemisphere.
pub fn gtr1(n_h: f64, alpha: f64) -> f64 {
    let a2 = alpha * alpha;
    (a2 - 1.0) / (PI * a2.ln() * (1.0 + (a2 - 1.0) * n_h * n_h))
}

/// Trowbridge–Reitz, normalised likewise.
pub fn gtr2(n_h: f64, alpha: f64) -> f64 {
    let a2 = alpha * alpha;
    let t = 1.0 + (a2 - 1.0) * n_h * n_h;
    a2 / (PI * t * t)
}

/// Smith's masking for Trowbridge–Reitz over 2·n·ω: two of them make G/(4·n·l·n·v).
fn smith(cosine: f64, alpha: f64) -> f64 {
    let (a2, c2) = (alpha * alpha, cosine * cosine);
    1.0 / (cosine + (a2 + c2 - a2 * c2).sqrt())
}

fn mirror(n: DVec3, direction: DVec3) -> DVec3 {
    2.0 * n.dot(direction) * n - direction
}

/// What directions are drawn from: a mixture, in equal parts, of the lobes that a BRDF has. The
/// cosine is always among them, so that the density is positive wherever the BRDF is.
#[derive(Debug, Clone, Copy)]
enum Lobe {
    Cosine,
    /// A cosine's power about the mirror direction.
    Power(f64),
    /// The mirror direction about a half vector from GTR2, or GTR1.
    Gtr2(f64),
    Gtr1(f64),
}

fn lobes(shading: Shading) -> Vec<Lobe> {
    let mut lobes = vec![Lobe::Cosine];
    match shading {
        Shading::Phong {
            specular,
            shininess,
        } if specular > 0.0 => {
            lobes.push(Lobe::Power(shininess));
        }
        Shading::Disney(d) => {
            lobes.push(Lobe::Gtr2(specular_alpha(d.roughness)));
            if d.clearcoat > 0.0 {
                lobes.push(Lobe::Gtr1(clearcoat_alpha(d.clearcoat_gloss)));
            }
        }
        _ => {}
    }
    lobes
}

/// A direction with the density below; it may point below the horizon.
pub fn sample(iso: &Isosurface, n: DVec3, outgoing: DVec3, random: &mut Random) -> DVec3 {
    let lobes = lobes(iso.shading);
    let lobe = lobes[(random.uniform() * lobes.len() as f64) as usize];
    let u = random.uniform();
    match lobe {
        Lobe::Cosine => random.around(n, u.sqrt()),
        Lobe::Power(k) => random.around(mirror(n, outgoing), u.powf(1.0 / (k + 1.0))),
        Lobe::Gtr2(alpha) => {
            let cosine = ((1.0 - u) / (1.0 + (alpha * alpha - 1.0) * u)).sqrt();
            mirror(random.around(n, cosine), outgoing)
        }
        Lobe::Gtr1(alpha) => {
            let a2 = alpha * alpha;
            let cosine = ((1.0 - a2.powf(1.0 - u)) / (1.0 - a2)).sqrt();
            mirror(random.around(n, cosine), outgoing)
        }
    }
}

/// The density of `sample` per solid angle, for n·incoming > 0.
pub fn density(iso: &Isosurface, n: DVec3, outgoing: DVec3, incoming: DVec3) -> f64 {
    let half = (incoming + outgoing).normalize();
    // |d half / d incoming| = 1 / (4·half·outgoing)
    let jacobian = n.dot(half) / (4.0 * half.dot(outgoing));
    let lobes = lobes(iso.shading);
    let sum: f64 = lobes
        .iter()
        .map(|lobe| match *lobe {
            Lobe::Cosine => n.dot(incoming) / PI,
            Lobe::Power(k) => (k + 1.0) / (2.0 * PI) * power(n, outgoing, incoming, k),
            Lobe::Gtr2(alpha) => gtr2(n.dot(half), alpha) * jacobian,
            Lobe::Gtr1(alpha) => gtr1(n.dot(half), alpha) * jacobian,
        })
        .sum();
    sum / lobes.len() as f64
}
