//! Which of the items 0, 1, 2, … are connected, as more and more of them are joined.

/// A forest whose trees are the connected parts.
pub struct Union {
    parent: Vec<u32>,
}

impl Union {
    /// Items that are not connected yet.
    pub fn new(items: usize) -> Self {
        Union {
            parent: (0..items as u32).collect(),
        }
    }

    /// The lowest item of a part. Paths are halved on the way, so that N calls take O(N log N).
    pub fn root(&mut self, mut item: u32) -> u32 {
        while self.parent[item as usize] != item {
            let up = self.parent[item as usize];
            self.parent[item as usize] = self.parent[up as usize];
            item = up;
        }
        item
    }

    /// Makes one set of the two that hold a and b.
    pub fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.parent[a.max(b) as usize] = a.min(b);
    }
}
