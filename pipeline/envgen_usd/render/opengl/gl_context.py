"""An off-screen OpenGL context: EGL, or OSMesa as a fallback."""

import ctypes
import os
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from envgen_usd.errors import EnvgenError

_NEEDED_VERSION = (4, 5)
_HELP = (
    "render: no OpenGL {}.{} without a screen; on Debian: "
    "apt-get install libegl1 libgl1-mesa-dri (EGL), or libosmesa6 (OSMesa)".format(*_NEEDED_VERSION)
)
_EGL_PLATFORM_DEVICE = 0x313F
_EGL_CUDA_DEVICE = 0x323A
_MAX_DEVICES = 32


@contextmanager
def open_context(width: int = 16, height: int = 16) -> Iterator[str]:
    """Makes an OpenGL context current within the `with` block.

    PyOpenGL binds to a platform for the life of the process, so the choice precedes any import of
    it. The choice is ``PYOPENGL_PLATFORM``, else ``egl``, else ``osmesa``. The device is that of
    ``EGL_DEVICE_ID``, else the first GPU of ``CUDA_VISIBLE_DEVICES``, by which clusters say which
    GPU a process may use, else the first device.

    Args:
        width: Width of the default framebuffer, pixels; it stays unused.
        height: Height of the default framebuffer, pixels.

    Yields:
        Name and version of the renderer, e.g. ``llvmpipe (LLVM 15.0.6, 256 bits), 4.5 ...``.

    Raises:
        EnvgenError: OpenGL is missing, or older than the shaders need.
    """
    platform = _platform(choose_platform(), width, height)
    try:
        platform.init_context()
        platform.make_current()
    except Exception as error:
        raise EnvgenError(f"{_HELP} ({type(error).__name__}: {error})") from error
    try:
        yield _renderer()
    finally:
        platform.delete_context()


def choose_platform() -> str:
    """Sets ``PYOPENGL_PLATFORM`` if it is not set, and returns it.

    Raises:
        EnvgenError: Neither EGL nor OSMesa works.
    """
    named = os.environ.get("PYOPENGL_PLATFORM")
    if named:
        return named
    device = _egl_device()
    if device is not None:
        os.environ["PYOPENGL_PLATFORM"] = "egl"
        os.environ.setdefault("EGL_DEVICE_ID", str(device))
    elif _loads("libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so"):
        os.environ["PYOPENGL_PLATFORM"] = "osmesa"
    else:
        raise EnvgenError(_HELP)
    return os.environ["PYOPENGL_PLATFORM"]


def _platform(name: str, width: int, height: int) -> Any:  # noqa: ANN401 - pyrender has no types
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            if name == "osmesa":
                from pyrender.platforms.osmesa import OSMesaPlatform  # noqa: PLC0415

                return OSMesaPlatform(width, height)
            from pyrender.platforms import egl  # noqa: PLC0415

            index = int(os.environ.get("EGL_DEVICE_ID", "0"))
            return egl.EGLPlatform(width, height, device=egl.get_device_by_index(index))
    except (ImportError, AttributeError, RuntimeError, ValueError) as error:
        raise EnvgenError(f"{_HELP} ({name}: {error})") from error


def _renderer() -> str:
    from OpenGL import GL as gl  # noqa: N811, PLC0415

    version = gl.glGetString(gl.GL_VERSION).decode()
    numbers = tuple(int(part) for part in version.split()[0].split(".")[:2])
    if numbers < _NEEDED_VERSION:
        raise EnvgenError(f"{_HELP} (found {version})")
    return f"{gl.glGetString(gl.GL_RENDERER).decode()}, {version}"


def _loads(*names: str) -> ctypes.CDLL | None:
    for name in names:
        try:
            return ctypes.CDLL(name)
        except OSError:
            continue
    return None


def _egl_device() -> int | None:
    """Number of the EGL device to draw with, or `None` if none can be initialised.

    Uses ctypes, because importing PyOpenGL would already bind the process to a platform.
    """
    egl = _loads("libEGL.so.1", "libEGL.so")
    if egl is None:
        return None
    egl.eglGetProcAddress.restype = ctypes.c_void_p
    query = egl.eglGetProcAddress(b"eglQueryDevicesEXT")
    display_of = egl.eglGetProcAddress(b"eglGetPlatformDisplayEXT")
    if not query or not display_of:
        return None
    handle = ctypes.c_void_p
    devices = (handle * _MAX_DEVICES)()
    count = ctypes.c_int()
    ctypes.CFUNCTYPE(ctypes.c_uint, ctypes.c_int, handle, handle)(query)(
        _MAX_DEVICES, ctypes.addressof(devices), ctypes.addressof(count)
    )
    get_display = ctypes.CFUNCTYPE(handle, ctypes.c_uint, handle, handle)(display_of)
    egl.eglInitialize.argtypes = [handle, handle, handle]
    known = devices[: count.value]
    for index in devices_in_order(range(len(known)), [_cuda_number(egl, each) for each in known]):
        display = get_display(_EGL_PLATFORM_DEVICE, known[index], None)
        if display and egl.eglInitialize(display, None, None):
            return index
    return None


def devices_in_order(devices: Sequence[int], cuda: Sequence[int | None]) -> list[int]:
    """Devices in the order in which they are tried, that of ``CUDA_VISIBLE_DEVICES`` first.

    EGL lists all devices, whatever the variable says (NVIDIA/cuda-python, pull request 2865).

    Args:
        devices: Numbers of EGL devices.
        cuda: CUDA's number of each of them; `None` for other makers.
    """
    named = os.environ.get("CUDA_VISIBLE_DEVICES", "").partition(",")[0].strip()
    return sorted(devices, key=lambda index: str(cuda[index]) != named)


def _cuda_number(egl: ctypes.CDLL, device: int | None) -> int | None:
    """CUDA's number of an EGL device (extension EGL_NV_device_cuda)."""
    query = egl.eglGetProcAddress(b"eglQueryDeviceAttribEXT")
    if not query:
        return None
    handle, value = ctypes.c_void_p, ctypes.c_ssize_t(-1)
    ask = ctypes.CFUNCTYPE(ctypes.c_uint, handle, ctypes.c_int, handle)(query)
    return value.value if ask(device, _EGL_CUDA_DEVICE, ctypes.addressof(value)) else None
