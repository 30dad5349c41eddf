//! Files of any outline, headers of any bytes.

use proptest::prelude::*;

use super::*;

fn precisions() -> impl Strategy<Value = Precision> {
    let origin = || prop::array::uniform3(-(1i64 << 62)..=1 << 62);
    let corner = prop::array::uniform3(prop::num::f32::NORMAL | prop::num::f32::ZERO);
    prop_oneof![
        (4..=24u8, corner, 0.0..6e38).prop_map(|(bits, origin, side)| Precision::Lattice {
            bits,
            origin,
            side
        }),
        (0..=9u8, 0..=5u8, origin()).prop_map(|(exponent, digits, origin)| Precision::Decimal {
            exponent,
            digits,
            origin
        }),
        (-149..=127i16, origin()).prop_map(|(exponent, origin)| Precision::Binary { exponent, origin }),
        (-149..=127i16, origin()).prop_map(|(exponent, origin)| Precision::Refined { exponent, origin }),
    ]
}

fn level_lists() -> impl Strategy<Value = Vec<LevelEntry>> {
    use LevelKind::{Adaptive, Butterfly, Sqrt3Even, Sqrt3Odd};
    let kinds = prop::sample::select(vec![Adaptive, Sqrt3Even, Sqrt3Odd, Butterfly]);
    let updates = prop::sample::select(vec![UpdateRule::None, UpdateRule::Third, UpdateRule::Paper]);
    let entry = (kinds, updates, 0..1u32 << 28, 0..1u32 << 28, 0.0f32..1e9);
    prop::collection::vec(entry, 1..9).prop_map(|entries| {
        let (mut vertices, mut faces) = (0, 0);
        let entries =
            entries.into_iter().enumerate().map(|(i, (kind, update, more_vertices, more_faces, error))| {
                vertices += more_vertices;
                faces += more_faces;
                let error = round_error_up(error);
                let base = level(LevelKind::Base, vertices, faces, error);
                if i == 0 { base } else { LevelEntry { kind, update, ..base } }
            });
        entries.collect()
    })
}

fn outlines() -> impl Strategy<Value = Outline> {
    let known = prop::sample::subsequence(
        vec![Supplement::Exactness, Supplement::Merges, Supplement::Leftovers, Supplement::Order],
        0..=4,
    );
    let optional = prop::collection::vec(128..=255u8, 0..3);
    let counts = (0..u32::MAX, 0..u32::MAX);
    let sources = (0..u32::MAX, 0..u32::MAX, any::<u64>(), 0.0f32..9.0, 0.0f32..9.0);
    let sources = sources.prop_map(|(vertices, faces, digest, rms, greatest)| {
        let [rms, greatest] = [rms, greatest].map(round_error_up);
        Approximation { vertices, faces, digest, rms, greatest }
    });
    let approximations = prop::option::of(sources);
    (any::<bool>(), precisions(), counts, approximations, level_lists(), known, optional).prop_map(
        |(kept, precision, (vertices, faces), approximation, levels, mut supplements, mut optional)| {
            optional.sort();
            let order_kept = kept || supplements.contains(&Supplement::Order);
            supplements.extend(optional.into_iter().map(Supplement::Optional));
            let (effort, streams) = (Effort::Fast, levels.len().min(MOST_STREAMS as usize) as u32);
            Outline {
                order_kept,
                effort,
                streams,
                precision,
                vertices,
                faces,
                approximation,
                levels,
                supplements,
            }
        },
    )
}

proptest! {
    #[test]
    fn what_is_written_is_read_in_any_portions(
        outline in outlines(),
        payloads in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..40), 14),
        portions in prop::collection::vec(1usize..50, 1..20),
    ) {
        let payloads = &payloads[..outline.levels.len() + outline.supplements.len()];
        let bytes = write(&outline, payloads).unwrap();
        let (arrived, reader, end) = read_in(&portions, &bytes, Limits::default());
        prop_assert!(end.is_ok(), "{:?}", end);
        prop_assert_eq!(arrived, expected(&outline, payloads));
        prop_assert_eq!(&reader.header().unwrap().outline, &outline);
    }

    #[test]
    fn any_header_is_refused_or_is_the_one_its_outline_gives(header in prop::collection::vec(any::<u8>(), 0..80)) {
        // The first fields are given, so that some headers get as far as the table.
        for start in [0, 2, TRIANGLE.len()] {
            let bytes = with_header(&[&TRIANGLE[..start], &header].concat());
            let mut reader = Reader::new(Limits::default());
            reader.push(&bytes);
            if let Some(header) = reader.header() {
                let extents: Vec<_> = header.sections.iter().map(|s| (s.length, s.crc)).collect();
                prop_assert_eq!(with_header(&header.outline.write(&extents)), bytes);
            }
        }
    }
}
