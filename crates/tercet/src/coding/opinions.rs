//! What the opinions about a coordinate weigh at first in the `max` profile.
//!
//! The means of the weights that six of the test meshes (igea, horse, fandisk, cow, cheburashka, dragon) end
//! with, at 12 bits and two late levels.

use super::ensemble::VECTORS;

/// For the side, the first bin, the next two, the next four, further ones, and halvings: the weights (in
/// 1/8192) of the thirteen experts, five contexts, four lists and the histogram; at the end that of the bias.
pub(super) static INITIAL: [[[i16; 8]; VECTORS]; 6] = [
    [
        [552, 1571, 2656, 185, 852, 1475, 1144, 166],
        [96, 21, 1220, 0, 0, 797, -356, 30],
        [-1426, -11, 1832, 2282, 433, 65, 500, 1097],
    ],
    [
        [1248, 1293, 2084, 107, 632, 542, 1309, 46],
        [-16, 338, 1045, 0, 0, 1378, -250, 358],
        [-826, 968, 2180, 2147, 918, 614, 500, -71],
    ],
    [
        [1259, 996, 1419, 168, 529, 192, 1177, -5],
        [61, 359, 1061, 0, 0, 1273, -172, 450],
        [-342, 399, 1426, 1554, 788, 644, 500, -139],
    ],
    [
        [1097, 670, 948, 428, 201, 551, 778, 56],
        [132, 595, 967, 0, 0, 317, 47, 271],
        [23, 234, 789, 1063, 655, 505, 500, -128],
    ],
    [
        [968, 690, 853, 828, 591, 761, 836, 508],
        [532, 771, 865, 0, 0, 252, 249, 231],
        [186, 236, 386, 471, 372, 326, 500, -25],
    ],
    [
        [514, 1172, 872, 573, 858, 592, 881, 468],
        [536, 530, 737, 0, 0, 423, -120, -74],
        [-208, 182, 1283, 1133, 763, 657, 500, -49],
    ],
];
