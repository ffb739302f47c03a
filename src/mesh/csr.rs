//! A list for each of many owners, all in one memory: the neighbours of every vertex, the triangles about it.

use std::ops::Range;

/// Lists one after the other.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Lists<T> {
    /// First entry of each, and one past the last.
    starts: Vec<u32>,
    entries: Vec<T>,
}

impl<T> Default for Lists<T> {
    fn default() -> Self {
        Self { starts: vec![0], entries: Vec::new() }
    }
}

impl<T> Lists<T> {
    /// How many there are.
    pub(crate) fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// First entry of each, and one past the last.
    pub(crate) fn starts(&self) -> &[u32] {
        &self.starts
    }

    /// Places of one's entries among those of all.
    pub(crate) fn range(&self, owner: usize) -> Range<usize> {
        self.starts[owner] as usize..self.starts[owner + 1] as usize
    }

    /// One's entries.
    pub(crate) fn of(&self, owner: usize) -> &[T] {
        &self.entries[self.range(owner)]
    }

    pub(crate) fn of_mut(&mut self, owner: usize) -> &mut [T] {
        let range = self.range(owner);
        &mut self.entries[range]
    }

    /// Entries of all.
    pub(crate) fn entries(&self) -> &[T] {
        &self.entries
    }

    /// Adds the list of the next owner.
    pub(crate) fn push(&mut self, list: impl IntoIterator<Item = T>) {
        self.entries.extend(list);
        self.starts.push(self.entries.len() as u32);
    }

    /// Adds the lists of the next owners.
    pub(crate) fn append(&mut self, mut other: Self) {
        let before = self.entries.len() as u32;
        self.starts.extend(other.starts[1..].iter().map(|start| before + start));
        self.entries.append(&mut other.entries);
    }
}

impl<T: Copy + Default> Lists<T> {
    /// Of so many owners, from entries with theirs, in any order: each one's stay in it. They are gone through twice.
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
    fn entries_are_their_owners_in_the_order_they_came() {
        let pairs = [(2, 'c'), (0, 'a'), (2, 'd'), (0, 'b')];
        let mut lists = Lists::gathered(3, || pairs.into_iter());
        assert_eq!([lists.of(0), lists.of(1), lists.of(2)], [&['a', 'b'][..], &[], &['c', 'd']]);
        let mut more = Lists::default();
        more.push(['e']);
        lists.append(more);
        assert_eq!((lists.len(), lists.of(3), lists.range(2)), (4, &['e'][..], 2..4));
    }
}
