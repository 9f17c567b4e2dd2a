"""Many inputs, each by itself: their list, their statuses, and the processes that work on them."""
