import pytest
import torch

from envgen_usd.landuse.network.model.attention import WindowAttention, spread_mask, window_side
from envgen_usd.landuse.network.model.conv_blocks import MaskedConv, ModulatedConv, activate


@pytest.mark.parametrize("stride", [1, 2])
def test_a_masked_convolution_follows_its_four_rules(stride):
    torch.manual_seed(0)
    conv = MaskedConv(3, 4, stride)
    x, mask = torch.randn(1, 3, 8, 8), (torch.rand(1, 1, 8, 8) < 0.15).float()
    y, after = conv(x, mask)
    weight = conv.conv.weight / (3 * 9) ** 0.5
    for row in range(8 // stride):
        for column in range(8 // stride):
            total, count = conv.conv.bias.clone(), 0
            for dy in (-1, 0, 1):
                for dx in (-1, 0, 1):
                    r, c = row * stride + dy, column * stride + dx
                    if 0 <= r < 8 and 0 <= c < 8 and mask[0, 0, r, c]:
                        total = total + weight[:, :, dy + 1, dx + 1] @ x[0, :, r, c]
                        count += 1
            expected = activate(total) * 9 / count if count else torch.zeros(4)
            assert torch.allclose(y[0, :, row, column], expected, atol=1e-5)
            assert after[0, 0, row, column] == float(count > 0)


def test_what_is_unknown_does_not_change_a_masked_convolution():
    torch.manual_seed(0)
    conv = MaskedConv(2, 4)
    x, mask = torch.randn(1, 2, 8, 8), (torch.rand(1, 1, 8, 8) < 0.5).float()
    other = torch.where(mask > 0, x, torch.randn_like(x))
    assert torch.equal(conv(x, mask)[0], conv(other, mask)[0])


def test_attention_does_not_see_unknown_tokens_nor_other_windows():
    torch.manual_seed(0)
    attention = WindowAttention(8, 2)
    x, mask = torch.randn(1, 8, 8, 8), (torch.rand(1, 8, 8, 1) < 0.5).float()
    mask[0, :4, :4] = 0.0
    mask[0, 0, 0] = 1.0
    changed = x.clone()
    changed[0, 1, 1] += 1.0  # unknown, in the first window
    before, _ = attention(x, mask, 4, 0)
    after, _ = attention(changed, mask, 4, 0)
    assert torch.allclose(before, after, atol=1e-5)
    changed = x.clone()
    changed[0, 0, 0] += 1.0  # known
    after, _ = attention(changed, mask, 4, 0)
    assert not torch.allclose(before[0, :4, :4], after[0, :4, :4], atol=1e-3)
    assert torch.equal(before[0, 4:], after[0, 4:])


def test_shifted_windows_do_not_join_opposite_edges():
    torch.manual_seed(0)
    attention = WindowAttention(8, 2)
    x = torch.randn(1, 8, 8, 8)
    changed = x.clone()
    changed[0, 0, 0] += 1.0
    before, after = attention(x, None, 4, 2)[0], attention(changed, None, 4, 2)[0]
    moved = (before - after).abs().amax(-1)[0] > 1e-4
    assert moved[:2, :2].all()
    assert not moved[2:].any()
    assert not moved[:, 2:].any()


def test_a_window_with_one_known_token_is_known_afterwards():
    mask = torch.zeros(1, 8, 8, 1)
    mask[0, 5, 1] = 1.0
    spread = spread_mask(mask, 4, 0)[0, :, :, 0]
    assert spread[4:, :4].all()
    assert spread.sum() == 16


@pytest.mark.parametrize(("side", "largest", "width"), [(32, 8, 8), (20, 8, 5), (12, 8, 6)])
def test_windows_tile_the_grid(side, largest, width):
    assert window_side(side, largest) == width


def test_modulating_activations_equals_modulating_weights():
    torch.manual_seed(0)
    conv, x, style = ModulatedConv(3, 5, 4), torch.randn(2, 3, 6, 6), torch.randn(2, 4)
    made = conv(x, style)
    for n in range(2):
        scale = conv.affine(style[n : n + 1])[0]
        weight = conv.conv.weight / 27**0.5 * scale[None, :, None, None]
        weight = weight * torch.rsqrt(weight.square().sum((1, 2, 3), keepdim=True) + 1e-8)
        expected = torch.nn.functional.conv2d(x[n : n + 1], weight, conv.conv.bias, padding=1)
        assert torch.allclose(made[n : n + 1], expected, atol=1e-5)
