"""Types that cross rooms: what goes in, what stages hand on, what comes out."""
