//! Points where an answer is hard: near the surface, the axis, joints and caps, and exactly there.

use glam::DVec3;

use super::oracle::{Oracle, Solid};

/// A small generator of random numbers (splitmix64), the same in every run.
#[derive(Debug, Clone)]
pub(crate) struct Random(u64);

impl Random {
    /// A generator of its own for each seed.
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0x5851_F42D_4C95_7F2D)
    }

    /// 64 random bits.
    pub(crate) fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// From 0 to below 1.
    pub(crate) fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 * f64::EPSILON / 2.0
    }

    /// From `low` to `high`.
    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// From 0 to below `n`.
    pub(crate) fn below(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }
}

/// A point of a piece given by homogeneous control points.
pub(crate) fn evaluate(control: &[[f64; 3]], t: f64) -> [f64; 2] {
    let mut p = control.to_vec();
    for level in 1..p.len() {
        for i in 0..p.len() - level {
            p[i] = std::array::from_fn(|c| (1.0 - t) * p[i][c] + t * p[i + 1][c]);
        }
    }
    [p[0][0] / p[0][2], p[0][1] / p[0][2]]
}

/// A point of the meridian: on a curve, or at the end of a piece.
fn meridian(solid: &Solid, random: &mut Random, joint: bool) -> [f64; 2] {
    let chain = &solid.region.small[random.below(solid.region.small.len())];
    let piece = &chain[random.below(chain.len())];
    let t = match (joint, random.below(4)) {
        (true, 0) => 0.0,
        (true, 1) => 1.0,
        (true, 2) => 10_f64.powf(random.between(-16.0, -2.0)),
        (true, _) => 1.0 - 10_f64.powf(random.between(-16.0, -2.0)),
        _ => random.unit(),
    };
    let p = evaluate(&piece.control, t);
    let center = solid.region.center;
    [p[0] + center[0], p[1] + center[1]]
}

/// A point near (or on) something of a random solid of the scene.
pub(crate) fn hard(oracle: &Oracle, random: &mut Random) -> DVec3 {
    let solid = &oracle.solids[random.below(oracle.solids.len())];
    let size = 2.0 * solid.region.extent;
    let [start, angle] = solid.turn;
    let far = |random: &mut Random| size * 10_f64.powf(random.between(-17.0, -6.0));
    let exact = random.below(16) == 0;
    let kind = random.below(8);
    let mut rz = meridian(solid, random, (4..6).contains(&kind));
    // In degrees; multiples of 90 turned from the start now and then, caps for one kind.
    let mut phi = if random.below(3) == 0 {
        90.0 * random.below(4) as f64
    } else {
        start + angle * random.between(-0.02, 1.02)
    };
    let mut aside = 0.0;
    if kind == 6 {
        // On the axis, at any height or at that of a piece.
        let extent = solid.region.extent;
        rz[0] = 0.0;
        if random.below(2) == 0 {
            rz[1] = solid.region.center[1] + extent * random.between(-1.1, 1.1);
        }
    } else if kind == 7 && angle < 360.0 {
        phi = if random.below(2) == 0 {
            start
        } else {
            start + angle
        };
        if random.below(3) > 0 {
            let other = meridian(solid, random, false);
            let mix = random.unit();
            rz = [0, 1].map(|i| rz[i] + mix * (other[i] - rz[i]));
        }
        aside = if exact {
            0.0
        } else {
            far(random) * random.between(-1.0, 1.0)
        };
    }
    if !exact {
        let (turn, length) = (random.between(0.0, std::f64::consts::TAU), far(random));
        rz[0] += length * turn.cos();
        rz[1] += length * turn.sin();
    }
    let right = (phi / 90.0).round();
    let (sin, cos) = if phi == 90.0 * right {
        let quarter = right.rem_euclid(4.0) as usize;
        (
            [0.0, 1.0, 0.0, -1.0][quarter],
            [1.0, 0.0, -1.0, 0.0][quarter],
        )
    } else {
        phi.to_radians().sin_cos()
    };
    solid.world([rz[0] * cos - aside * sin, rz[0] * sin + aside * cos, rz[1]])
}

/// A point of a box half as large again as the bounds.
pub(crate) fn uniform(low: DVec3, high: DVec3, random: &mut Random) -> DVec3 {
    let (middle, half) = ((low + high) / 2.0, (high - low) * 0.75);
    middle + DVec3::from_array(std::array::from_fn(|i| half[i] * random.between(-1.0, 1.0)))
}
