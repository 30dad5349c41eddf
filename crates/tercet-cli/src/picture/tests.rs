use super::*;

const SIZE: Size = Size { width: 100, height: 80 };
const FRONT: View = View { azimuth: 0.0, elevation: 0.0, up: Y };
const X: Up = Up { axis: 0, negative: false };
const Y: Up = Up { axis: 1, negative: false };
const Z: Up = Up { axis: 2, negative: false };
const WHITE: Colour = Colour([255; 3]);

/// Two triangles that face the camera: the unit square's lower left half at z = 0, and all of the
/// square at z = −1 behind it.
fn layered() -> Mesh {
    let positions = vec![
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, -1.0],
        [1.0, 0.0, -1.0],
        [1.0, 1.0, -1.0],
        [0.0, 1.0, -1.0],
    ];
    Mesh { positions, faces: vec![[3, 5, 6], [3, 4, 5], [0, 1, 2]] }
}

fn picture<'a>(mesh: &'a Mesh, style: Style<'a>) -> Picture<'a> {
    Picture { mesh, style, flat: true, background: Some(WHITE) }
}

fn visible(mesh: &Mesh, view: &View) -> (Vec<u32>, impl Fn([f32; 3]) -> usize + use<>) {
    let camera = Camera::fit(mesh, view, SIZE).unwrap();
    let positions: Vec<_> = mesh.positions.iter().map(|&p| camera.to_view(p)).collect();
    let size = Size { width: SIZE.width * SUPERSAMPLING, height: SIZE.height * SUPERSAMPLING };
    let seen = raster::visible(&positions, &mesh.faces, &camera, size);
    let sample = move |p: [f32; 3]| {
        let [x, y, _] = camera.project(camera.to_view(p)).unwrap();
        y as usize * size.width + x as usize
    };
    (seen.faces, sample)
}

#[test]
fn the_nearer_face_is_seen_whichever_comes_first() {
    let mut mesh = layered();
    for front in [2, 0] {
        let (seen, sample) = visible(&mesh, &FRONT);
        assert_eq!(seen[sample([0.25, 0.25, 0.0])], front);
        assert_ne!(seen[sample([0.9, 0.9, -1.0])], front);
        assert_ne!(seen[sample([0.9, 0.9, -1.0])], raster::NOTHING);
        assert_eq!(seen[0], raster::NOTHING);
        mesh.faces.rotate_right(1);
    }
    // From behind the square hides the triangle.
    let (seen, sample) = visible(&layered(), &View { azimuth: 180.0, ..FRONT });
    assert!(seen[sample([0.25, 0.25, -1.0])] < 2);
    assert!(!seen.contains(&2));
}

#[test]
fn a_triangle_covers_what_it_should_and_shared_edges_leave_no_gap() {
    let positions = vec![[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 3.0, 0.0], [0.0, 3.0, 0.0]];
    let square = Mesh { positions, faces: vec![[0, 1, 2], [0, 2, 3]] };
    let (seen, sample) = visible(&square, &FRONT);
    let width = SIZE.width * SUPERSAMPLING;
    let (low, high) = (sample([0.0, 3.0, 0.0]), sample([4.0, 0.0, 0.0]));
    for y in low / width + 1..high / width {
        for x in low % width + 1..high % width {
            assert_ne!(seen[y * width + x], raster::NOTHING, "{x} {y}");
        }
    }
    let covered = seen.iter().filter(|&&f| f != raster::NOTHING).count();
    let inside = (high / width - low / width) * (high % width - low % width);
    assert!(covered.abs_diff(inside) < 2 * (SIZE.width + SIZE.height) * SUPERSAMPLING, "{covered} {inside}");
    let half = seen.iter().filter(|&&f| f == 0).count();
    assert!(covered.abs_diff(2 * half) < 2 * SIZE.width * SUPERSAMPLING, "{covered} {half}");
}

#[test]
fn every_vertex_is_in_the_picture_and_the_picture_is_filled() {
    for (azimuth, elevation, up) in [(0.0, 0.0, Y), (30.0, 20.0, Z), (200.0, -70.0, X)] {
        let mesh = tercet::shapes::scan(300, 1);
        let far =
            Mesh { positions: mesh.positions.iter().map(|p| p.map(|x| 1e-3 * x + 50.0)).collect(), ..mesh };
        let camera = Camera::fit(&far, &View { azimuth, elevation, up }, SIZE).unwrap();
        let seen = |k: usize| far.positions.iter().map(move |&p| (p, k));
        let mut filled = 0.0f64;
        for (k, side) in [(0, SIZE.width), (1, SIZE.height)] {
            let side = (side * SUPERSAMPLING) as f64;
            let at = |(p, k): ([f32; 3], usize)| camera.project(camera.to_view(p)).unwrap()[k] / side;
            let (low, high) = seen(k).map(at).fold((1.0f64, 0.0f64), |(l, h), x| (l.min(x), h.max(x)));
            assert!(low >= 0.03 && high <= 0.97, "{k}: {low} to {high}");
            assert!((low + high - 1.0).abs() < 0.02, "{k}: {low} to {high}");
            filled = filled.max(high - low);
        }
        assert!(filled > 0.85, "{filled}");
    }
}

#[test]
fn axes_point_where_they_should() {
    let camera = |azimuth, elevation, up| Camera::towards(&View { azimuth, elevation, up }, SIZE);
    let near = |a: [f64; 3], b: [f64; 3]| assert!((0..3).all(|k| (a[k] - b[k]).abs() < 1e-12), "{a:?} {b:?}");
    near(camera(0.0, 0.0, Y).to_view([0.0, 1.0, 0.0]), [0.0, 1.0, 0.0]);
    near(camera(90.0, 0.0, Y).to_view([1.0, 0.0, 0.0]), [0.0, 0.0, 1.0]);
    near(camera(0.0, 90.0, Y).to_view([0.0, 1.0, 0.0]), [0.0, 0.0, 1.0]);
    near(camera(0.0, 0.0, Z).to_view([0.0, 0.0, 1.0]), [0.0, 1.0, 0.0]);
    near(camera(0.0, 0.0, Z).to_view([0.0, -1.0, 0.0]), [0.0, 0.0, 1.0]);
    near(camera(0.0, 0.0, X).to_view([1.0, 0.0, 0.0]), [0.0, 1.0, 0.0]);
    for axis in 0..3 {
        let up = Up { axis, negative: true };
        near(
            camera(0.0, 0.0, up).to_view([0, 1, 2].map(|k| if k == axis { -1.0 } else { 0.0 })),
            [0.0, 1.0, 0.0],
        );
    }
    assert_eq!(Up::parse("-z"), Some(Up { axis: 2, negative: true }));
    for bad in ["", "-", "w", "--y", "yy"] {
        assert_eq!(Up::parse(bad), None, "{bad}");
    }
}

#[test]
fn pixels_are_lit_surface_background_or_a_mixture() {
    let mesh = layered();
    let camera = Camera::fit(&mesh, &FRONT, SIZE).unwrap();
    let image = picture(&mesh, Style::Shaded).draw(&camera, SIZE);
    assert_eq!(image.at(0, 0), [255; 4]);
    let [x, y, _] = camera.project(camera.to_view([0.25, 0.25, 0.0])).unwrap();
    let [r, g, b, a] = image.at(x as usize / SUPERSAMPLING, y as usize / SUPERSAMPLING);
    assert!(b > g && g > r && a == 255, "{r} {g} {b}");
    let clear = Picture { background: None, ..picture(&mesh, Style::Shaded) }.draw(&camera, SIZE);
    assert_eq!(clear.at(0, 0), [0; 4]);
    let opacities: Vec<u8> = (0..SIZE.height)
        .flat_map(|y| (0..SIZE.width).map(move |x| (x, y)))
        .map(|(x, y)| clear.at(x, y)[3])
        .collect();
    assert!(opacities.contains(&255) && opacities.iter().any(|&a| a > 0 && a < 255));
    assert_eq!(image, picture(&mesh, Style::Shaded).draw(&camera, SIZE));
}

#[test]
fn a_closed_surface_looks_the_same_inside_out_and_an_open_one_has_two_sides() {
    let sphere = tercet::shapes::sphere(2);
    let turned = Mesh { faces: sphere.faces.iter().map(|&[a, b, c]| [b, a, c]).collect(), ..sphere.clone() };
    let draw = |mesh: &Mesh, azimuth: f64| {
        let camera = Camera::fit(mesh, &View { azimuth, ..FRONT }, SIZE).unwrap();
        picture(mesh, Style::Shaded).draw(&camera, SIZE).at(50, 40)
    };
    assert_eq!(draw(&sphere, 0.0), draw(&turned, 0.0));
    let mut cup = tercet::shapes::sphere(3);
    cup.faces.retain(|f| f.iter().all(|&v| cup.positions[v as usize][2] > -0.2));
    let (outside, inside) = (draw(&cup, 0.0), draw(&cup, 180.0));
    assert!(outside[2] > outside[0] && inside[0] > inside[2], "{outside:?} {inside:?}");
}

#[test]
fn even_and_odd_vertices_have_their_colours() {
    let mesh = layered();
    let camera = Camera::fit(&mesh, &FRONT, SIZE).unwrap();
    let image = picture(&mesh, Style::Division { kept: 1 }).draw(&camera, SIZE);
    let at = |p: [f32; 3]| {
        let [x, y, _] = camera.project(camera.to_view(p)).unwrap();
        image.at(x as usize / SUPERSAMPLING, y as usize / SUPERSAMPLING)
    };
    let even = at([0.015, 0.015, 0.0]);
    let odd = at([0.95, 0.01, 0.0]);
    assert!(even[2] > even[0] + 60, "{even:?}");
    assert!(odd[0] > odd[2] + 60, "{odd:?}");
}

#[test]
fn errors_go_from_the_first_colour_to_the_last_with_a_scale_beside() {
    let mesh = layered();
    let flat = Mesh { positions: mesh.positions.clone(), faces: vec![[3, 4, 5], [3, 5, 6]] };
    let reference = TriangleTree::new(&flat).unwrap();
    let style = || Style::Error { reference: &reference, diagonal: 2.0, scale: None };
    let size = Size { width: 300, height: 160 };
    let surface = Size { width: width_for_surface(&style(), size.width), ..size };
    assert!(surface.width < size.width);
    let camera = Camera::fit(&mesh, &FRONT, surface).unwrap();
    let image = picture(&mesh, style()).draw(&camera, size);
    let at = |p: [f32; 3]| {
        let [x, y, _] = camera.project(camera.to_view(p)).unwrap();
        image.at(x as usize / SUPERSAMPLING, y as usize / SUPERSAMPLING).map(u32::from)
    };
    let (none, most) = (at([0.9, 0.9, -1.0]), at([0.25, 0.25, 0.0]));
    assert!(none[0] + none[1] + none[2] > most[0] + most[1] + most[2] + 300, "{none:?} {most:?}");
    let strip = (surface.width..size.width).flat_map(|x| (0..size.height).map(move |y| (x, y)));
    let written = strip.filter(|&(x, y)| image.at(x, y)[..3] == colour::TEXT.0).count();
    assert!(written > 100, "{written}");
}

#[test]
fn normals_are_smooth_on_a_sphere_and_sharp_on_a_cube() {
    let sphere = tercet::shapes::sphere(3);
    let at: Vec<_> = sphere.positions.iter().map(|p| p.map(f64::from)).collect();
    for (face, corners) in sphere.faces.iter().zip(normals::corner_normals(&at, &sphere.faces, false)) {
        for (v, n) in face.iter().zip(corners) {
            assert!(normals::dot(n, at[*v as usize]) > 0.999);
        }
    }
    // Two faces at a right angle.
    let at = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0; 3]];
    let faces = [[0, 1, 2], [0, 3, 1], [4, 4, 1]];
    let found = normals::corner_normals(&at, &faces, false);
    assert_eq!(found, [[[0.0, 0.0, 1.0]; 3], [[0.0, 1.0, 0.0]; 3], [[0.0; 3]; 3]]);
}

#[test]
fn colours_are_read_and_light_returns_to_them() {
    assert_eq!(Colour::parse("#0a80FF"), Some(Colour([10, 128, 255])));
    for bad in ["0a80ff", "#0a80f", "#0a80fg", "#+a80ff", "white", ""] {
        assert_eq!(Colour::parse(bad), None, "{bad}");
    }
    for c in 0..=255 {
        assert_eq!(Colour::of(Colour([c; 3]).light()), Colour([c; 3]));
    }
    assert_eq!(Colour::of_error(-1.0), Colour::of_error(0.0));
    assert_eq!(Colour::of_error(7.0), Colour::of_error(1.0));
}

#[test]
fn a_png_begins_and_ends_like_one() {
    let image = Image::new(Size { width: 3, height: 2 }, Some(WHITE));
    let png = image.png().unwrap();
    assert_eq!(png[..8], [137, 80, 78, 71, 13, 10, 26, 10]);
    assert_eq!(png[16..24], [0, 0, 0, 3, 0, 0, 0, 2]);
}
