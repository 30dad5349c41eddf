//! Which vertices, or which faces, lie next to each other.

/// Most neighbours that a node keeps, so that any walk over the graph takes linear time.
const DEGREE: usize = 32;

/// An undirected graph without loops; compressed rows.
pub(super) struct Graph {
    start: Vec<u32>,
    neighbours: Vec<u32>,
}

impl Graph {
    /// The vertices of `faces`, joined by their edges.
    pub fn of_vertices(vertices: u32, faces: &[[u32; 3]]) -> Self {
        Graph::new(vertices, || faces.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]))
    }

    /// The faces, joined across their edges: each edge chains the faces that use it, in order.
    pub fn of_faces(vertices: u32, faces: &[[u32; 3]]) -> Self {
        // Edges by their lesser end; of each the greater end and the face.
        let edges = || {
            faces.iter().enumerate().flat_map(|(f, &[a, b, c])| {
                [[a, b], [b, c], [c, a]].map(|[a, b]| (a.min(b), a.max(b), f as u32))
            })
        };
        let mut start = vec![0u32; vertices as usize + 1];
        edges().for_each(|(a, ..)| start[a as usize + 1] += 1);
        accumulate(&mut start);
        let mut fill = start.clone();
        let mut buckets = vec![(0, 0); 3 * faces.len()];
        for (a, b, f) in edges() {
            buckets[fill[a as usize] as usize] = (b, f);
            fill[a as usize] += 1;
        }
        for v in 0..vertices as usize {
            buckets[start[v] as usize..start[v + 1] as usize].sort_unstable();
        }
        let chained = || {
            let rows = (0..vertices as usize).map(|v| &buckets[start[v] as usize..start[v + 1] as usize]);
            rows.flat_map(|row| row.windows(2).filter(|w| w[0].0 == w[1].0).map(|w| [w[0].1, w[1].1]))
        };
        Graph::new(faces.len() as u32, chained)
    }

    /// A graph of the given edges; loops and repeated edges are passed over. A node keeps its
    /// least neighbours, and of these the ones that keep it. Time O(n log n).
    fn new<I: Iterator<Item = [u32; 2]>>(nodes: u32, edges: impl Fn() -> I) -> Self {
        let edges = || edges().filter(|[a, b]| a != b);
        let mut start = vec![0u32; nodes as usize + 1];
        edges().flatten().for_each(|v| start[v as usize + 1] += 1);
        accumulate(&mut start);
        let mut fill = start.clone();
        let mut neighbours = vec![0; start[nodes as usize] as usize];
        for [a, b] in edges() {
            for [a, b] in [[a, b], [b, a]] {
                neighbours[fill[a as usize] as usize] = b;
                fill[a as usize] += 1;
            }
        }
        let mut graph = Graph { start, neighbours };
        graph.rewrite(|row, kept| {
            row.sort_unstable();
            kept.extend(row.chunk_by(|a, b| a == b).map(|same| same[0]).take(DEGREE));
        });
        let crowded: Vec<u32> = (0..nodes).filter(|&v| graph.row(v).len() == DEGREE).collect();
        if !crowded.is_empty() {
            let rows: Vec<Vec<u32>> = crowded.iter().map(|&v| graph.row(v).to_vec()).collect();
            let mut v = 0;
            graph.rewrite(|row, kept| {
                kept.extend(row.iter().filter(|&n| match crowded.binary_search(n) {
                    Ok(i) => rows[i].binary_search(&v).is_ok(),
                    Err(_) => true,
                }));
                v += 1;
            });
        }
        graph
    }

    /// Replaces each row, in order, by what `keep` puts into an empty list, no longer than the row.
    fn rewrite(&mut self, mut keep: impl FnMut(&mut [u32], &mut Vec<u32>)) {
        let mut kept = Vec::new();
        let (mut end, mut row_start) = (0, 0);
        for v in 1..self.start.len() {
            let row_end = self.start[v] as usize;
            kept.clear();
            keep(&mut self.neighbours[row_start..row_end], &mut kept);
            self.neighbours[end..end + kept.len()].copy_from_slice(&kept);
            end += kept.len();
            self.start[v] = end as u32;
            row_start = row_end;
        }
        self.neighbours.truncate(end);
    }

    /// Number of nodes.
    pub fn nodes(&self) -> u32 {
        self.start.len() as u32 - 1
    }

    /// The neighbours of `v`, ascending.
    pub fn row(&self, v: u32) -> &[u32] {
        &self.neighbours[self.start[v as usize] as usize..self.start[v as usize + 1] as usize]
    }

    /// Whether `a` and `b` are neighbours.
    pub fn joins(&self, a: u32, b: u32) -> bool {
        self.row(a).binary_search(&b).is_ok()
    }
}

/// From the length of each row, one entry late, to where each begins.
fn accumulate(start: &mut [u32]) {
    for v in 1..start.len() {
        start[v] += start[v - 1];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_are_mutual_and_few() {
        let fan: Vec<[u32; 3]> = (1..80).map(|v| [0, v, v + 1]).chain([[7, 7, 9], [1, 2, 0]]).collect();
        let graph = Graph::of_vertices(82, &fan);
        assert_eq!(graph.nodes(), 82);
        assert_eq!(graph.row(0), (1..=32).collect::<Vec<_>>());
        assert_eq!(graph.row(7), [0, 6, 8, 9]);
        assert_eq!(graph.row(33), [32, 34]);
        assert_eq!(graph.row(81), []);
        assert!((0..82).all(|v| graph.row(v).iter().all(|&n| graph.joins(n, v))));
    }

    #[test]
    fn faces_are_joined_across_edges_and_a_crowded_edge_is_a_chain() {
        let graph = Graph::of_faces(6, &[[0, 1, 2], [1, 0, 3], [0, 1, 4], [2, 1, 5]]);
        assert_eq!(graph.row(0), [1, 3]);
        assert_eq!(graph.row(1), [0, 2]);
        assert_eq!(graph.row(2), [1]);
        assert_eq!(graph.row(3), [0]);
    }
}
