"""Windowed attention to known tokens, which propagates the mask of known tokens."""

import torch
from torch import Tensor, nn
from torch.nn import functional as F  # noqa: N812 - torch's own convention

from envgen_usd.landuse.network.model.conv_blocks import Linear, MaskedConv, activate, merge

BLOCKED = -100.0
"""Logit of an ignored key; a more negative value suppresses it further."""


def window_side(side: int, largest: int) -> int:
    """Side of the windows that tile a grid: its largest divisor up to a limit."""
    return max(width for width in range(1, min(side, largest) + 1) if side % width == 0)


def to_windows(x: Tensor, side: int) -> Tensor:
    """Cuts B x H x W x C into windows: B · n x side² x C, row by row."""
    b, h, w, c = x.shape
    x = x.view(b, h // side, side, w // side, side, c)
    return x.permute(0, 1, 3, 2, 4, 5).reshape(-1, side * side, c)


def from_windows(windows: Tensor, side: int, height: int, width: int) -> Tensor:
    """Inverse of `to_windows`: B x H x W x C."""
    c = windows.shape[-1]
    x = windows.view(-1, height // side, width // side, side, side, c)
    return x.permute(0, 1, 3, 2, 4, 5).reshape(-1, height, width, c)


def split_bias(height: int, width: int, side: int, shift: int) -> Tensor:
    """Blocks pairs of tokens that share a window only because of the cyclic shift.

    Returns:
        n x side² x side² of 0 and `BLOCKED`.
    """
    rows, columns = (
        (torch.arange(count) >= count - side).float() + (torch.arange(count) >= count - shift)
        for count in (height, width)
    )
    region = rows[:, None] * 3 + columns[None, :]
    marks = to_windows(region[None, :, :, None], side)[..., 0]  # n x side²
    return (marks[:, :, None] != marks[:, None, :]).float() * BLOCKED


class WindowAttention(nn.Module):
    """Multi-head attention over windows, with the update of the mask.

    Queries and keys come from normalised tokens, values from the tokens themselves. A window with
    any known token is known afterwards; a window without known tokens averages all of its tokens.
    """

    def __init__(self, dim: int, heads: int) -> None:
        """Args: channels of a token, and number of heads."""
        super().__init__()
        self.query, self.key, self.value = Linear(dim, dim), Linear(dim, dim), Linear(dim, dim)
        self.project = Linear(dim, dim)
        self._heads = heads

    def forward(
        self, x: Tensor, mask: Tensor | None, side: int, shift: int
    ) -> tuple[Tensor, Tensor | None]:
        """Attends.

        Args:
            x: B x H x W x C.
            mask: B x H x W x 1, 1 where known, or `None` if all tokens are known.
            side: Side of a window.
            shift: Shift of the windows, tokens; 0 leaves them in place.

        Returns:
            Tokens and their mask, in the shapes of the inputs.
        """
        b, h, w, _ = x.shape
        bias = self._bias(mask, (b, h, w), side, shift, x)
        x = torch.roll(x, (-shift, -shift), (1, 2)) if shift else x
        tokens = to_windows(x, side)
        unit = F.normalize(tokens, dim=-1)
        q, k, v = (
            self._split(part) for part in (self.query(unit), self.key(unit), self.value(tokens))
        )
        # Single precision: its gradient is several times faster on processors.
        with torch.autocast(x.device.type, enabled=x.device.type != "cpu"):
            y = F.scaled_dot_product_attention(q.float(), k.float(), v.float(), attn_mask=bias)
        y = self.project(y.transpose(1, 2).reshape(tokens.shape))
        y = from_windows(y, side, h, w)
        y = torch.roll(y, (shift, shift), (1, 2)) if shift else y
        return y, None if mask is None else spread_mask(mask, side, shift)

    def _split(self, x: Tensor) -> Tensor:
        n, tokens, c = x.shape
        return x.view(n, tokens, self._heads, c // self._heads).transpose(1, 2)

    def _bias(
        self, mask: Tensor | None, shape: tuple[int, int, int], side: int, shift: int, like: Tensor
    ) -> Tensor | None:
        """B · n x 1 x (1 or side²) x side² logits to add, or `None`."""
        b, h, w = shape
        bias: Tensor | None = None
        if mask is not None:
            rolled = torch.roll(mask, (-shift, -shift), (1, 2)) if shift else mask
            bias = (1 - to_windows(rolled, side)).transpose(1, 2)[:, None] * BLOCKED
        if shift:
            split = split_bias(h, w, side, shift).to(like).repeat(b, 1, 1)[:, None]
            bias = split if bias is None else bias + split
        return None if bias is None else bias.float().expand(-1, -1, side * side, -1)


def spread_mask(mask: Tensor, side: int, shift: int) -> Tensor:
    """Makes every window with a known token known; mask is B x H x W x 1."""
    _, h, w, _ = mask.shape
    rolled = torch.roll(mask, (-shift, -shift), (1, 2)) if shift else mask
    windows = to_windows(rolled, side)
    known = windows.amax(1, keepdim=True).expand_as(windows)
    spread = from_windows(known, side, h, w)
    return torch.roll(spread, (shift, shift), (1, 2)) if shift else spread


class Block(nn.Module):
    """Transformer block without layer norm: MLP(FC(concat[x, attention(x)]))."""

    def __init__(self, dim: int, heads: int) -> None:
        """Args: channels of a token, attention heads."""
        super().__init__()
        self.attention = WindowAttention(dim, heads)
        self.fuse = Linear(2 * dim, dim)
        self.widen, self.narrow = Linear(dim, 2 * dim), Linear(2 * dim, dim)

    def forward(
        self, x: Tensor, mask: Tensor | None, side: int, shift: int
    ) -> tuple[Tensor, Tensor | None]:
        """Maps B x H x W x C tokens and their mask to the same shapes."""
        y, mask = self.attention(x, mask, side, shift)
        x = self.fuse(torch.cat([x, y], dim=-1))
        return self.narrow(activate(self.widen(x))), mask


class Group(nn.Module):
    """Blocks on a grid; every other block shifts its windows by half of their side."""

    def __init__(self, dim: int, heads: int, depth: int, window: int, aware: bool) -> None:
        """Args: channels, heads, number of blocks, largest window side, use of the mask."""
        super().__init__()
        self.blocks = nn.ModuleList(Block(dim, heads) for _ in range(depth))
        self.conv = MaskedConv(dim, dim, aware=aware)
        self._window, self._aware = window, aware

    def forward(self, x: Tensor, mask: Tensor | None) -> tuple[Tensor, Tensor | None]:
        """Maps B x C x H x W features (mask B x 1 x H x W, or `None`) to the same shapes."""
        side = window_side(min(x.shape[2:]), self._window)
        tokens = x.permute(0, 2, 3, 1)
        known = mask.permute(0, 2, 3, 1) if mask is not None and self._aware else None
        for number, block in enumerate(self.blocks):
            moved = side // 2 if number % 2 and side < min(x.shape[2:]) else 0
            tokens, known = block(tokens, known, side, moved)
        y = tokens.permute(0, 3, 1, 2)
        after = torch.ones_like(y[:, :1]) if known is None else known.permute(0, 3, 1, 2)
        y, after = self.conv(y, after)
        return merge(x, y), None if mask is None else after
