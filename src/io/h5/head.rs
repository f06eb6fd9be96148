//! What stands before the arrays: the superblock, the groups, and the small arrays of coordinates.

#[cfg(feature = "hdf5")]
use super::object::chunked_dataset;
use super::object::{Attribute, FIXED_HEAD, Header, UNDEFINED, dataset, group, superblock};
use crate::io::format::{Description, Element};

/// The bytes before the arrays, and where these are.
#[derive(Debug)]
pub(super) struct Head {
    pub(super) bytes: Vec<u8>,
    /// Where each array begins.
    pub(super) arrays: Vec<u64>,
    /// Bytes of the whole file.
    pub(super) length: u64,
}

/// An array of the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Array {
    /// Its channel.
    pub(super) channel: usize,
    /// Samples along x, y and z.
    pub(super) dims: [usize; 3],
    /// Whether it has the last sides of a staggered channel, too.
    pub(super) has_last: bool,
    /// Bytes of a layer.
    pub(super) layer_bytes: usize,
}

/// The arrays: one for each channel, then, for VTK, those of staggered channels without the last sides.
pub(super) fn arrays(of: &Description) -> Vec<Array> {
    let one = |channel: usize, has_last: bool| {
        let spec = &of.channels[channel];
        let lattice = if has_last {
            of.lattice(spec)
        } else {
            of.centres()
        };
        Array {
            channel,
            dims: lattice.dims,
            has_last,
            layer_bytes: lattice.layer_bytes(spec),
        }
    };
    let is_staggered = |channel: &usize| of.channels[*channel].staggered.is_some();
    let all = 0..of.channels.len();
    let own = all
        .clone()
        .map(|channel| one(channel, is_staggered(&channel)));
    own.chain(all.filter(is_staggered).map(|channel| one(channel, false)))
        .collect()
}

/// How the channels' arrays are held.
#[derive(Debug)]
pub(super) enum Held {
    Contiguous,
    /// In chunks of so many layers, found by trees at these places in a file of this length.
    #[cfg(feature = "hdf5")]
    Chunks {
        layers: u64,
        trees: Vec<u64>,
        length: u64,
    },
}

const AXES: [&str; 3] = ["x", "y", "z"];

/// Lays the file out. Headers have the same size whatever addresses are in them, so they are made twice: first to know
/// how large they are.
pub(super) fn of(of: &Description, held: &Held) -> Head {
    let arrays = arrays(of);
    let mut places = Places {
        headers: vec![0; 3 + AXES.len() + arrays.len()],
        axes: [0; 3],
        arrays: vec![0; arrays.len()],
    };
    let mut at = FIXED_HEAD;
    for (place, header) in headers(of, held, &places).iter().enumerate() {
        places.headers[place] = at;
        at = aligned(at + header.len() as u64);
    }
    for (axis, place) in places.axes.iter_mut().enumerate() {
        *place = at;
        at += 8 * of.grid.dims()[axis] as u64;
    }
    let start = at;
    let length = match held {
        Held::Contiguous => {
            for (array, place) in arrays.iter().zip(&mut places.arrays) {
                *place = at;
                at = aligned(at + array.layer_bytes as u64 * array.dims[2] as u64);
            }
            at
        }
        #[cfg(feature = "hdf5")]
        Held::Chunks { trees, length, .. } => {
            places.arrays.clone_from(trees);
            *length
        }
    };
    let mut bytes = superblock(length, places.headers[0]);
    for (place, header) in headers(of, held, &places).into_iter().enumerate() {
        bytes.resize(places.headers[place] as usize, 0);
        bytes.extend(header);
    }
    bytes.resize(places.axes[0] as usize, 0);
    for axis in 0..3 {
        let centres = (0..of.grid.dims()[axis]).map(|n| of.grid.centre_along(axis, n));
        bytes.extend(centres.flat_map(f64::to_le_bytes));
    }
    debug_assert_eq!(bytes.len() as u64, start);
    Head {
        bytes,
        arrays: places.arrays,
        length,
    }
}

fn aligned(at: u64) -> u64 {
    at.next_multiple_of(8)
}

/// Addresses, all of them multiples of 8.
struct Places {
    /// The root group, `VTKHDF`, its `CellData`, the axes, the arrays.
    headers: Vec<u64>,
    axes: [u64; 3],
    arrays: Vec<u64>,
}

fn headers(of: &Description, held: &Held, places: &Places) -> Vec<Vec<u8>> {
    let dims = of.grid.dims().map(|n| n as u64);
    let [nx, ny, nz] = dims;
    let (at_axes, at_arrays) = places.headers[3..].split_at(AXES.len());
    let arrays = arrays(of);
    // VTK's are the last ones of a channel.
    let mut of_channels: Vec<(&str, u64)> = Vec::new();
    let mut of_cells: Vec<(&str, u64)> = Vec::new();
    for (array, &at) in arrays.iter().zip(at_arrays) {
        let name = of.channels[array.channel].name.as_str();
        match of_channels.get(array.channel) {
            None => {
                of_channels.push((name, at));
                of_cells.push((name, at));
            }
            Some(_) => of_cells[array.channel].1 = at,
        }
    }
    let of_axes = AXES.into_iter().zip(at_axes.iter().copied());
    let links: Vec<(&str, u64)> = (of_channels.iter().copied())
        .chain(of_axes)
        .chain([("VTKHDF", places.headers[1])])
        .collect();
    let origin = of.grid.origin().to_array();
    let spacing = of.grid.spacing().to_array();
    let mut root = Header::default();
    group(&mut root, &links);
    root.attribute("origin", &Attribute::Floats(&origin));
    root.attribute("spacing", &Attribute::Floats(&spacing));
    root.attribute("dims", &Attribute::Integers(&dims));
    root.attribute("units", &Attribute::Text(&of.units));
    root.attribute("sign_convention", &Attribute::Text(of.sign()));
    if let Some(scene) = &of.scene {
        root.attribute("scene", &Attribute::Text(&scene.name));
        root.attribute("scene_hash", &Attribute::Text(&scene.hash));
    }
    let mut image = Header::default();
    group(&mut image, &[("CellData", places.headers[2])]);
    image.attribute("Version", &Attribute::Integers(&[1, 0]));
    image.attribute("Type", &Attribute::Text("ImageData"));
    image.attribute("WholeExtent", &Attribute::Integers(&[0, nx, 0, ny, 0, nz]));
    image.attribute("Origin", &Attribute::Floats(&origin));
    image.attribute("Spacing", &Attribute::Floats(&spacing));
    let identity = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    image.attribute("Direction", &Attribute::Floats(&identity));
    let mut cells = Header::default();
    group(&mut cells, &of_cells);
    let mut headers = vec![root.finish(), image.finish(), cells.finish()];
    for (axis, name) in AXES.iter().enumerate() {
        let mut header = Header::default();
        dataset(&mut header, Element::F64, &[dims[axis]], places.axes[axis]);
        header.attribute(
            "meaning",
            &Attribute::Text(&format!("{name} of the voxel centres")),
        );
        header.attribute("units", &Attribute::Text(&of.units));
        headers.push(header.finish());
    }
    for (array, at) in arrays.iter().zip(&places.arrays) {
        let channel = &of.channels[array.channel];
        let [nx, ny, nz] = array.dims.map(|n| n as u64);
        let mut header = Header::default();
        let element = Element::of(channel.kind);
        match held {
            Held::Contiguous => dataset(&mut header, element, &[nz, ny, nx], *at),
            #[cfg(feature = "hdf5")]
            Held::Chunks { layers, .. } => {
                let chunk = [*layers, ny, nx];
                chunked_dataset(&mut header, element, &[nz, ny, nx], &chunk, *at);
            }
        }
        header.attribute("meaning", &Attribute::Text(&channel.meaning));
        if array.has_last {
            let first = of.lattice(channel).first;
            header.attribute("first", &Attribute::Floats(&first));
        }
        if let Some(unit) = &channel.unit {
            header.attribute("units", &Attribute::Text(unit));
        }
        headers.push(header.finish());
    }
    debug_assert!(!places.headers.contains(&UNDEFINED));
    headers
}
