//! Why a layer cannot be encoded or decoded.
//!
//! Each message says what is wrong and what to do about it.

/// Why a layer cannot be encoded or decoded.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ExrError {
    /// An image needs a channel.
    #[error("a layer needs at least one channel; name one, such as sdf")]
    NoChannels,
    /// A channel's name is unusable.
    #[error(
        "channel name {name:?} is not usable; use 1 to 255 printable ASCII characters without blanks"
    )]
    ChannelName {
        /// The name.
        name: String,
    },
    /// Two channels have one name.
    #[error("channel {name:?} appears twice; each channel needs its own name")]
    DuplicateChannel {
        /// The name.
        name: String,
    },
    /// A channel has the wrong number of samples.
    #[error("channel {name:?} has {found} samples; a layer of {width} x {height} voxels needs {}", width * height)]
    ChannelLength {
        /// The channel.
        name: String,
        /// Its samples.
        found: usize,
        /// Voxels along x.
        width: usize,
        /// Voxels along y.
        height: usize,
    },
    /// The image is larger than the format can hold.
    #[error(
        "a layer of {width} x {height} voxels does not fit an OpenEXR file; use a coarser grid"
    )]
    Size {
        /// Voxels along x.
        width: usize,
        /// Voxels along y.
        height: usize,
    },
    /// A header attribute is unusable.
    #[error("header attribute {name:?} {reason}; rename or drop it")]
    Attribute {
        /// The attribute.
        name: String,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// The encoder refused.
    #[error("the layer could not be encoded ({reason}); please report this")]
    Encode {
        /// The encoder's reason.
        reason: String,
    },
    /// The bytes are not an intact OpenEXR file.
    #[error("not an intact OpenEXR file ({reason}); write the stack again")]
    Damaged {
        /// The decoder's reason.
        reason: String,
    },
    /// The file is intact, perhaps, but of a kind that stacks do not have.
    #[error("{reason}; a slice is one flat scan-line image")]
    Unsupported {
        /// What was found.
        reason: &'static str,
    },
}
