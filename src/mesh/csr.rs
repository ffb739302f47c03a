//! A list for each of many owners in one allocation (compressed sparse rows): neighbours or triangles of each vertex.

use std::ops::Range;

/// The lists of owners 0, 1, 2, ..., one after the other.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Csr<T> {
    /// Index of the first entry of each owner, and one past the last entry.
    starts: Vec<u32>,
    entries: Vec<T>,
}

impl<T> Default for Csr<T> {
    fn default() -> Self {
        Self { starts: vec![0], entries: Vec::new() }
    }
}

impl<T> Csr<T> {
    /// Number of owners.
    pub(crate) fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// Index of the first entry of each owner, and one past the last entry.
    pub(crate) fn starts(&self) -> &[u32] {
        &self.starts
    }

    /// Indices of an owner's entries among all entries.
    pub(crate) fn range(&self, owner: usize) -> Range<usize> {
        self.starts[owner] as usize..self.starts[owner + 1] as usize
    }

    /// The entries of an owner.
    pub(crate) fn of(&self, owner: usize) -> &[T] {
        &self.entries[self.range(owner)]
    }

    pub(crate) fn of_mut(&mut self, owner: usize) -> &mut [T] {
        let range = self.range(owner);
        &mut self.entries[range]
    }

    /// The entries of all owners.
    pub(crate) fn entries(&self) -> &[T] {
        &self.entries
    }

    /// Adds the list of the next owner.
    pub(crate) fn push(&mut self, list: impl IntoIterator<Item = T>) {
        self.entries.extend(list);
        self.starts.push(self.entries.len() as u32);
    }

    /// The lists of several, one after the other.
    pub(crate) fn joined(several: Vec<Self>) -> Self {
        let mut all = Self::default();
        all.entries.reserve(several.iter().map(|lists| lists.entries.len()).sum());
        several.into_iter().for_each(|lists| all.append(lists));
        all
    }

    /// Adds the lists of the next owners.
    pub(crate) fn append(&mut self, mut other: Self) {
        let before = self.entries.len() as u32;
        self.starts.extend(other.starts[1..].iter().map(|start| before + start));
        self.entries.append(&mut other.entries);
    }
}

impl<T: Copy + Default> Csr<T> {
    /// The lists of `owners`, from entries with their owners in any order; an owner's entries keep theirs. `entries` is called
    /// twice.
    pub(crate) fn gathered<P: Iterator<Item = (u32, T)>>(owners: usize, entries: impl Fn() -> P) -> Self {
        let mut starts = vec![0u32; owners + 1];
        entries().for_each(|(owner, _)| starts[owner as usize + 1] += 1);
        for i in 0..owners {
            starts[i + 1] += starts[i];
        }
        let mut next = starts.clone();
        let mut all = vec![T::default(); starts[owners] as usize];
        for (owner, entry) in entries() {
            let place = &mut next[owner as usize];
            all[*place as usize] = entry;
            *place += 1;
        }
        Self { starts, entries: all }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_of_an_owner_keep_their_order() {
        let pairs = [(2, 'c'), (0, 'a'), (2, 'd'), (0, 'b')];
        let mut csr = Csr::gathered(3, || pairs.into_iter());
        assert_eq!([csr.of(0), csr.of(1), csr.of(2)], [&['a', 'b'][..], &[], &['c', 'd']]);
        let mut more = Csr::default();
        more.push(['e']);
        csr.append(more);
        assert_eq!((csr.len(), csr.of(3), csr.range(2)), (4, &['e'][..], 2..4));
    }
}
