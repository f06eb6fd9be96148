//! The quantities that every scene has: one list, which all that names, stores or describes one reads.
//!
//! A new quantity is one entry here and what samples it. Parameters and fields of volumes are named by their scene.

use std::ops::RangeInclusive;

/// How the samples of a quantity are kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Stored {
    /// 0 or 1: a byte in memory, a half in an OpenEXR file.
    Mask,
    /// A 32-bit float.
    Real,
    /// A 32-bit unsigned integer.
    Id,
}

/// What a quantity is measured in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Unit {
    /// Nothing: a number.
    Number,
    /// This power of the scene's unit of length.
    Length(i8),
    /// Degrees.
    Degrees,
}

impl Unit {
    /// How it is written, where `length` is the label of the scene's lengths; `None` of a number.
    #[must_use]
    pub fn label(self, length: &str) -> Option<String> {
        match self {
            Self::Number | Self::Length(0) => None,
            Self::Length(1) => Some(length.to_owned()),
            Self::Length(power) => Some(format!("{length}^{power}")),
            Self::Degrees => Some("degrees".to_owned()),
        }
    }
}

/// What is known of a quantity.
struct Entry {
    channel: Channel,
    name: &'static str,
    stored: Stored,
    unit: Unit,
    /// What its samples are between, where that is known beforehand.
    range: Option<RangeInclusive<f32>>,
    /// Whether runs of equal samples fill most of a layer.
    is_mostly_constant: bool,
    meaning: &'static str,
}

macro_rules! channels {
    ($($(#[$about:meta])* $variant:ident = $name:literal, $stored:ident, $unit:expr, $range:expr, $constant:literal, $meaning:literal;)+) => {
        /// A quantity sampled on a grid.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum Channel {
            $($(#[$about])* $variant,)+
        }

        const ENTRIES: &[Entry] = &[
            $(Entry {
                channel: Channel::$variant,
                name: $name,
                stored: Stored::$stored,
                unit: $unit,
                range: $range,
                is_mostly_constant: $constant,
                meaning: $meaning,
            },)+
        ];

        impl Channel {
            /// All of them, in the order they are listed to users.
            pub const ALL: &[Self] = &[$(Self::$variant,)+];
        }
    };
}

/// From the middle of a voxel.
const HALF: Option<RangeInclusive<f32>> = Some(-0.5..=0.5);
/// Shares of a whole.
const SHARE: Option<RangeInclusive<f32>> = Some(0.0..=1.0);

channels! {
    /// 1 where the voxel's centre is inside, else 0.
    Occupancy = "occupancy", Mask, Unit::Number, SHARE, true,
        "1 where the voxel centre is inside the solid or on its surface, else 0";
    /// The share of the voxel that is inside.
    Fraction = "fraction", Real, Unit::Number, SHARE, true,
        "part of the voxel's volume that is inside the solid";
    /// Signed distance of the voxel's centre, negative inside.
    Sdf = "sdf", Real, Unit::Length(1), None, false,
        "distance from the voxel centre to the surface, negative inside";
    /// Material id at the voxel's centre, 0 outside.
    Material = "material", Id, Unit::Number, None, true,
        "id of the material at the voxel centre, 0 where empty";
    /// Share of the voxel's lower side across x that is within the solid's interior.
    FaceX = "face-x", Real, Unit::Number, SHARE, true,
        "share of the voxel's lower side across x that is within the solid's interior";
    /// Share of the voxel's lower side across y that is within the solid's interior.
    FaceY = "face-y", Real, Unit::Number, SHARE, true,
        "share of the voxel's lower side across y that is within the solid's interior";
    /// Share of the voxel's lower side across z that is within the solid's interior.
    FaceZ = "face-z", Real, Unit::Number, SHARE, true,
        "share of the voxel's lower side across z that is within the solid's interior";
    /// X of the centroid of the voxel's solid part, from its centre in spacings, 0 where there is none.
    CentroidX = "centroid-x", Real, Unit::Number, HALF, true,
        "x of the centroid of the voxel's solid part, from its centre in spacings, 0 where there is none";
    /// Y of the centroid of the voxel's solid part, from its centre in spacings, 0 where there is none.
    CentroidY = "centroid-y", Real, Unit::Number, HALF, true,
        "y of the centroid of the voxel's solid part, from its centre in spacings, 0 where there is none";
    /// Z of the centroid of the voxel's solid part, from its centre in spacings, 0 where there is none.
    CentroidZ = "centroid-z", Real, Unit::Number, HALF, true,
        "z of the centroid of the voxel's solid part, from its centre in spacings, 0 where there is none";
    /// Area of the solid's boundary in the voxel.
    BoundaryArea = "boundary-area", Real, Unit::Length(2), None, true,
        "area of the solid's boundary in the voxel";
    /// X of the centroid of the boundary in the voxel, from its centre in spacings, 0 where there is none.
    BoundaryX = "boundary-x", Real, Unit::Number, HALF, true,
        "x of the centroid of the boundary in the voxel, from its centre in spacings, 0 where there is none";
    /// Y of the centroid of the boundary in the voxel, from its centre in spacings, 0 where there is none.
    BoundaryY = "boundary-y", Real, Unit::Number, HALF, true,
        "y of the centroid of the boundary in the voxel, from its centre in spacings, 0 where there is none";
    /// Z of the centroid of the boundary in the voxel, from its centre in spacings, 0 where there is none.
    BoundaryZ = "boundary-z", Real, Unit::Number, HALF, true,
        "z of the centroid of the boundary in the voxel, from its centre in spacings, 0 where there is none";
    /// Integral of x of the outward unit normal over the boundary in the voxel.
    BoundaryNormalX = "boundary-normal-x", Real, Unit::Length(2), None, true,
        "integral of x of the outward unit normal over the boundary in the voxel";
    /// Integral of y of the outward unit normal over the boundary in the voxel.
    BoundaryNormalY = "boundary-normal-y", Real, Unit::Length(2), None, true,
        "integral of y of the outward unit normal over the boundary in the voxel";
    /// Integral of z of the outward unit normal over the boundary in the voxel.
    BoundaryNormalZ = "boundary-normal-z", Real, Unit::Length(2), None, true,
        "integral of z of the outward unit normal over the boundary in the voxel";
    /// X of the unit gradient of the distance at the nearest boundary point.
    NormalX = "normal-x", Real, Unit::Number, Some(-1.0..=1.0), false,
        "x of the unit gradient of the distance at the nearest boundary point";
    /// Y of the unit gradient of the distance at the nearest boundary point.
    NormalY = "normal-y", Real, Unit::Number, Some(-1.0..=1.0), false,
        "y of the unit gradient of the distance at the nearest boundary point";
    /// Z of the unit gradient of the distance at the nearest boundary point.
    NormalZ = "normal-z", Real, Unit::Number, Some(-1.0..=1.0), false,
        "z of the unit gradient of the distance at the nearest boundary point";
    /// X of the boundary point nearest to the voxel centre.
    ClosestX = "closest-x", Real, Unit::Length(1), None, false,
        "x of the boundary point nearest to the voxel centre";
    /// Y of the boundary point nearest to the voxel centre.
    ClosestY = "closest-y", Real, Unit::Length(1), None, false,
        "y of the boundary point nearest to the voxel centre";
    /// Z of the boundary point nearest to the voxel centre.
    ClosestZ = "closest-z", Real, Unit::Length(1), None, false,
        "z of the boundary point nearest to the voxel centre";
    /// Mean curvature of the boundary at its nearest point, 1/R on a ball of radius R, 0 on edges.
    CurvatureMean = "curvature-mean", Real, Unit::Length(-1), None, false,
        "mean curvature of the boundary at its nearest point, 1/R on a ball of radius R, 0 on edges";
    /// Gaussian curvature of the boundary at its nearest point, 0 on edges.
    CurvatureGauss = "curvature-gauss", Real, Unit::Length(-2), None, false,
        "Gaussian curvature of the boundary at its nearest point, 0 on edges";
    /// Angle of the nearest boundary point about the axis of its solid, counter-clockwise from the axis' x, 0 on the axis.
    Azimuth = "azimuth", Real, Unit::Degrees, Some(0.0..=360.0), false,
        "angle of the nearest boundary point about the axis of its solid, counter-clockwise from the axis' x, 0 on the axis";
    /// Number of the profile's curve at the nearest boundary point and the share of its parameter, -1 on what is no such curve.
    ProfileParameter = "profile-parameter", Real, Unit::Number, None, false,
        "number of the profile's curve at the nearest boundary point and the share of its parameter, -1 on what is no such curve";
}

impl Channel {
    fn entry(self) -> &'static Entry {
        // In the order of the variants.
        &ENTRIES[self as usize]
    }

    /// The name users write.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.entry().name
    }

    /// The quantity of that name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        let found = ENTRIES.iter().find(|entry| entry.name == name);
        found.map(|entry| entry.channel)
    }

    /// What a sample says.
    #[must_use]
    pub fn meaning(self) -> &'static str {
        self.entry().meaning
    }

    /// How its samples are kept.
    #[must_use]
    pub fn stored(self) -> Stored {
        self.entry().stored
    }

    /// What it is measured in.
    #[must_use]
    pub fn unit(self) -> Unit {
        self.entry().unit
    }

    /// Least and greatest value that a sample may have, where that is known beforehand.
    #[must_use]
    pub fn range(self) -> Option<RangeInclusive<f32>> {
        self.entry().range.clone()
    }

    /// The axis across which its samples are those of sides and not of voxels: there is one more of them along it.
    #[must_use]
    pub fn staggered(self) -> Option<usize> {
        match self {
            Self::FaceX => Some(0),
            Self::FaceY => Some(1),
            Self::FaceZ => Some(2),
            _ => None,
        }
    }

    /// Whether runs of equal samples fill most of a layer.
    #[must_use]
    pub fn is_mostly_constant(self) -> bool {
        self.entry().is_mostly_constant
    }
}

/// Some of the quantities.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Channels(u64);

impl Channels {
    /// None of them.
    pub const NONE: Self = Self(0);

    /// Whether `channel` is one of them.
    #[must_use]
    pub fn has(self, channel: Channel) -> bool {
        self.0 & (1 << channel as u32) != 0
    }

    /// The same with `channel`.
    #[must_use]
    pub const fn with(self, channel: Channel) -> Self {
        Self(self.0 | (1 << channel as u32))
    }

    /// Those that are of both.
    #[must_use]
    pub const fn and(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Each of them, in the order of the list.
    pub fn iter(self) -> impl Iterator<Item = Channel> {
        Channel::ALL.iter().copied().filter(move |c| self.has(*c))
    }
}

impl Channels {
    /// What is asked of the voxels that the boundary cuts.
    pub const OF_CUT_CELLS: Self = Self::NONE
        .with(Channel::FaceX)
        .with(Channel::FaceY)
        .with(Channel::FaceZ)
        .with(Channel::CentroidX)
        .with(Channel::CentroidY)
        .with(Channel::CentroidZ)
        .with(Channel::BoundaryArea)
        .with(Channel::BoundaryX)
        .with(Channel::BoundaryY)
        .with(Channel::BoundaryZ)
        .with(Channel::BoundaryNormalX)
        .with(Channel::BoundaryNormalY)
        .with(Channel::BoundaryNormalZ);

    /// What is asked of the boundary's point that is nearest to a voxel's centre.
    pub const OF_NEAREST_POINT: Self = Self::NONE
        .with(Channel::NormalX)
        .with(Channel::NormalY)
        .with(Channel::NormalZ)
        .with(Channel::ClosestX)
        .with(Channel::ClosestY)
        .with(Channel::ClosestZ)
        .with(Channel::CurvatureMean)
        .with(Channel::CurvatureGauss)
        .with(Channel::Azimuth)
        .with(Channel::ProfileParameter);
}

impl FromIterator<Channel> for Channels {
    fn from_iter<I: IntoIterator<Item = Channel>>(channels: I) -> Self {
        channels.into_iter().fold(Self::NONE, Self::with)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_entry_is_its_channels_and_each_name_is_one() {
        assert!(Channel::ALL.len() <= 64);
        for (index, &channel) in Channel::ALL.iter().enumerate() {
            assert_eq!(channel as usize, index);
            assert_eq!(channel.entry().channel, channel);
            assert_eq!(Channel::from_name(channel.name()), Some(channel));
            // OpenEXR's Python reader wants ASCII, and no name twice.
            assert!(channel.name().bytes().all(|b| b.is_ascii_graphic()));
        }
        assert_eq!(Channel::from_name("Sdf"), None);
    }

    #[test]
    fn sets_hold_what_they_are_made_of() {
        let some = Channels::from_iter([Channel::Sdf, Channel::Occupancy]);
        assert!(some.has(Channel::Sdf) && !some.has(Channel::Fraction));
        let listed: Vec<Channel> = some.iter().collect();
        assert_eq!(listed, [Channel::Occupancy, Channel::Sdf]);
        assert_eq!(
            some.and(Channels::NONE.with(Channel::Material)),
            Channels::NONE
        );
        assert!(Channels::NONE.is_empty());
    }
}
