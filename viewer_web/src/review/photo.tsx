/** The photo of a comment: taken or chosen, made small in the browser, and shown. */

import { useEffect, useState } from 'preact/hooks';
import type { ReviewClient } from '../api/review-client.ts';
import { t } from '../language/language.ts';
import './photo.css';

/** As the server takes them, see docs/viewer-api.md. */
export const LONGEST_EDGE = 1600;
const MOST_BYTES = 1024 * 1024;
/** A picture of leaves or gravel may need the last one. */
const QUALITIES = [0.85, 0.7, 0.5, 0.3];

/** Width and height that fit, in whole pixels. */
export function fitted(width: number, height: number): readonly [number, number] {
  const scale = Math.min(1, LONGEST_EDGE / Math.max(width, height));
  return [Math.max(1, Math.round(width * scale)), Math.max(1, Math.round(height * scale))];
}

/** Upright, and without what the camera wrote into the file: place, time, its name. */
export async function smallPhoto(file: Blob): Promise<Blob> {
  const picture = await createImageBitmap(file).catch(() => {
    throw new Error(t('The file is no picture that this browser can read. Choose another one.'));
  });
  const canvas = document.createElement('canvas');
  [canvas.width, canvas.height] = fitted(picture.width, picture.height);
  const drawing = canvas.getContext('2d')!;
  // JPEG knows no transparency: what is left out would be black.
  drawing.fillStyle = '#ffffff';
  drawing.fillRect(0, 0, canvas.width, canvas.height);
  drawing.drawImage(picture, 0, 0, canvas.width, canvas.height);
  picture.close();
  for (const quality of QUALITIES) {
    const photo = await new Promise<Blob | null>((done) => canvas.toBlob(done, 'image/jpeg', quality));
    if (photo !== null && photo.size <= MOST_BYTES) return photo;
  }
  throw new Error(t('The photo stays too large. Choose another one.'));
}

interface PhotoChoiceProps {
  readonly reviewClient: ReviewClient;
  readonly onChange: (photo: Blob) => void;
}

export function PhotoChoice({ reviewClient, onChange }: PhotoChoiceProps) {
  const take = async (file: File): Promise<void> => {
    try {
      onChange(await smallPhoto(file));
    } catch (error) {
      reviewClient.warn((error as Error).message);
    }
  };
  const choice = (words: string, camera: { capture?: 'environment'; name: string }) => (
    <label class={`button button-small photo-choice ${camera.name}`}>
      {words}
      <input
        type="file"
        accept="image/*"
        {...(camera.capture === undefined ? {} : { capture: camera.capture })}
        onChange={({ currentTarget }) => {
          const [file] = currentTarget.files ?? [];
          if (file !== undefined) void take(file);
          currentTarget.value = '';
        }}
      />
    </label>
  );
  return (
    <>
      {/* Some phones offer only their pictures, and some only the camera where it is asked for. */}
      {choice(t('Take a photo'), { capture: 'environment', name: 'photo-camera' })}
      {choice(t('Add a photo'), { name: 'photo-file' })}
    </>
  );
}

export function ChosenPhoto({ photo, onRemove }: { photo: Blob; onRemove: () => void }) {
  const [address, setAddress] = useState('');
  useEffect(() => {
    const made = URL.createObjectURL(photo);
    setAddress(made);
    return () => URL.revokeObjectURL(made);
  }, [photo]);
  return (
    <div class="photo-chosen">
      {address !== '' && <img class="photo" src={address} alt={t('Photo of the comment')} />}
      <button type="button" class="button button-small" onClick={onRemove}>
        {t('Remove photo')}
      </button>
    </div>
  );
}

/** Small; large in a page of its own. */
export function Photo({ sha256 }: { sha256: string }) {
  const address = `api/review/photos/${sha256}`;
  return (
    <a class="photo-link" href={address} target="_blank" rel="noopener" title={t('Open the photo')}>
      <img class="photo" src={address} alt={t('Photo of the comment')} loading="lazy" />
    </a>
  );
}
