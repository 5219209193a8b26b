"""One BLAS thread everywhere, before numpy is imported: two threads give other bits than one."""

from fras_common.threads import one_thread

one_thread()
