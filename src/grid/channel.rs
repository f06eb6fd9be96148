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
    pub fn with(self, channel: Channel) -> Self {
        Self(self.0 | (1 << channel as u32))
    }

    /// Those that are of both.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
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
