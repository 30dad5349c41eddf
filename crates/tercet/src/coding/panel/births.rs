//! Which of the last levels brought a vertex.

/// Numbers of vertices of the last two surfaces whose faces were split, the later one first.
///
/// How old its vertices are says more of whether a face is split, or an edge turned, than their valences do.
#[derive(Clone, Copy, Default)]
pub(crate) struct Births([u32; 2]);

impl Births {
    /// Number of ages.
    pub const AGES: usize = 3;

    /// 0 for a vertex of the last level, 1 for one of the level before, 2 for an older one.
    #[inline(always)]
    pub fn age(self, v: u32) -> usize {
        self.0.iter().filter(|&&count| v < count).count()
    }

    /// Notes that a surface of so many vertices has been refined.
    pub fn advance(&mut self, vertices: u32) {
        self.0 = [vertices, self.0[0]];
    }
}
